#include "sensors/tractions/bead_field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "tests/sensors/tractions/half_space_markers.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using touchstone::test::message_of;

class BeadsInView : public testing::Test {
 protected:
  BeadsInView() : map_(fixtures::half_space_markers(3, 4, 2.0)) {}

  /// Markers are 3 mm apart; 25 px are a mm.
  std::vector<Eigen::Vector2d> pictured(double turn_rad) const {
    const Eigen::Rotation2D<double> turn(turn_rad);
    std::vector<Eigen::Vector2d> px;
    for (const Eigen::Vector3d& mm : map_.marker_rest)
      px.push_back(Eigen::Vector2d(320, 240) + 25.0 * (turn * mm.head<2>()));
    return px;
  }
  static TrackedBeads found_at(const std::vector<Eigen::Vector2d>& positions) {
    TrackedBeads beads;
    beads.positions = positions;
    beads.status.assign(positions.size(), BeadStatus::kFound);
    return beads;
  }
  std::string refused(const std::vector<Eigen::Vector2d>& rest) const {
    return message_of([&] { view_of(rest, map_); });
  }
  MarkerCompliance map_;
};

TEST_F(BeadsInView, ScaleTurnAndOriginAreThoseOfThePicture) {
  for (const double turn : {0.0, 0.1, -0.3}) {
    const BeadView view = view_of(pictured(turn), map_);
    EXPECT_NEAR(view.px_per_mm, 25.0, 1e-9);
    EXPECT_NEAR(view.turn_rad, turn, 1e-12);
    EXPECT_LT((view.offset_px - Eigen::Vector2d(320, 240)).norm(), 1e-9);
    EXPECT_NEAR(view.rms_px, 0.0, 1e-9);
  }
}

TEST_F(BeadsInView, MotionsAreGivenInTheGelsAxes) {
  const auto rest = pictured(0.2);
  const BeadView view = view_of(rest, map_);
  auto moved = rest;
  for (Eigen::Vector2d& px : moved) px += 25.0 * (Eigen::Rotation2D<double>(0.2) * Eigen::Vector2d(0.3, -0.1));
  TrackedBeads beads = found_at(moved);
  beads.status[4] = BeadStatus::kHidden;
  const MarkerField field = bead_field(beads, rest, view, map_);
  EXPECT_EQ(field.grid, Eigen::Vector2i(3, 3));
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(field.measured[i], i == 4 ? 0 : 1);
    if (field.measured[i]) {
      EXPECT_LT((field.displacement[i] - Eigen::Vector3d(0.3, -0.1, 0.0)).norm(), 1e-12);
    }
  }
}

TEST_F(BeadsInView, OtherBeadsAndPicturesAreRefused) {
  auto rest = pictured(0.0);
  EXPECT_THAT(refused({rest.begin(), rest.begin() + 4}), HasSubstr("there are 4 rest positions"));
  const MarkerCompliance lone = fixtures::half_space_markers(1, 4, 2.0);
  EXPECT_THAT(message_of([&] { view_of(std::vector<Eigen::Vector2d>(1, {3, 4}), lone); }), HasSubstr("one bead"));
  EXPECT_THAT(refused(std::vector<Eigen::Vector2d>(9, Eigen::Vector2d(7, 7))), HasSubstr("coincide"));
  EXPECT_THAT(refused(pictured(1.57)), HasSubstr("turned by 90 degrees"));
  auto mirrored = rest;
  for (Eigen::Vector2d& px : mirrored) px.x() = 640.0 - px.x();
  EXPECT_THAT(refused(mirrored), HasSubstr("coincide"));  // no similarity: the best one has no size
  auto aside = rest;
  for (std::size_t i = 0; i < 9; i += 2) aside[i] += Eigen::Vector2d(40.0, 0.0);
  EXPECT_THAT(refused(aside), HasSubstr("px aside from"));
  rest[3].x() = std::nan("");
  EXPECT_THAT(refused(rest), HasSubstr("bead 3 isn't finite"));
  const BeadView view = view_of(pictured(0.0), map_);
  EXPECT_THAT(message_of([&] {
                bead_field(found_at({{1, 2}}), pictured(0.0), view, map_);
              }),
              HasSubstr("there are 1 tracked positions"));
}

}  // namespace
}  // namespace touchstone::sensors
