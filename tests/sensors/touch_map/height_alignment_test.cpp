#include "sensors/touch_map/height_alignment.h"

#include <gtest/gtest.h>

#include "tests/sensors/touch_map/drawn_relief.h"

namespace touchstone::sensors {
namespace {

/// Largest distance between where two poses take the corners of a touch of 16 x 12 mm.
double apart(const PlanarPose& a, const PlanarPose& b) {
  double most = 0.0;
  for (const double x : {-8.0, 8.0}) {
    for (const double y : {-6.0, 6.0})
      most = std::max(most, (a * Eigen::Vector2d(x, y) - b * Eigen::Vector2d(x, y)).norm());
  }
  return most;
}

class Alignment_ : public ::testing::Test {
 protected:
  const fixtures::Surface relief = fixtures::strewn_relief(4);
  const ReliefDetail to = relief_detail(fixtures::touch_of(relief, {}, 1), {});
  const PlanarPose truth{0.6, {1.0, -0.7}};
};

TEST_F(Alignment_, FindsThePoseFromNearby) {
  const ReliefDetail from = relief_detail(fixtures::touch_of(relief, truth, 2), {});
  for (int i = 0; i < 8; ++i) {
    const PlanarPose start =
        truth * PlanarPose{i % 2 ? 0.01 : -0.01, {0.1 * std::cos(i * 0.8), 0.1 * std::sin(i * 0.8)}};
    const Alignment found = align(from, to, start, {});
    EXPECT_TRUE(found.converged);
    EXPECT_LT(apart(found.to_from_from, truth), 0.005) << "a tenth of a pixel";
    EXPECT_GT(found.correlation, 0.98);
  }
}

TEST_F(Alignment_, ADeeperAndTiltedPressChangesLittle) {
  const fixtures::Surface deeper = [&](const Eigen::Vector2d& p) { return 0.3 + 0.005 * p.x() + 1.4 * relief(p); };
  const ReliefDetail from = relief_detail(fixtures::touch_of(deeper, truth, 2), {});
  const Alignment found = align(from, to, truth * PlanarPose{0.005, {0.06, -0.05}}, {});
  EXPECT_TRUE(found.converged);
  EXPECT_LT(apart(found.to_from_from, truth), 0.005);
}

TEST_F(Alignment_, WhatStandsInOneOfThemOnlyIsLeftOut) {
  // A crumb on the gel, in the touch but not on the object.
  const PlanarPose touch_from_object = truth.inverse();
  const fixtures::Surface dirty = [&](const Eigen::Vector2d& p) {
    return relief(p) + 0.2 * std::exp(-(touch_from_object * p - Eigen::Vector2d(2, 1)).squaredNorm() / 0.5);
  };
  const ReliefDetail from = relief_detail(fixtures::touch_of(dirty, truth, 2), {});
  const Alignment found = align(from, to, truth * PlanarPose{0.005, {0.06, -0.05}}, {});
  EXPECT_TRUE(found.converged);
  EXPECT_LT(apart(found.to_from_from, truth), 0.01);
}

TEST_F(Alignment_, APlaneGivesTheStartBack) {
  const fixtures::Surface plane = [](const Eigen::Vector2d&) { return 0.3; };
  fixtures::Camera still;
  still.noise_mm = 0.0;
  const ReliefDetail flat = relief_detail(fixtures::touch_of(plane, {}, 1, still), {});
  const PlanarPose start{0.3, {0.2, 0.1}};
  const Alignment found = align(flat, flat, start, {});
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(apart(found.to_from_from, start), 0.0);
}

TEST_F(Alignment_, ItDoesNotGoAstray) {
  const ReliefDetail from = relief_detail(fixtures::touch_of(relief, truth, 2), {});
  const PlanarPose start = truth * PlanarPose{1.0, {3, 3}};
  const Alignment found = align(from, to, start, {});
  EXPECT_LE(apart(found.to_from_from, start), 20.0 * 0.5) << "moved at most 0.5 mm at the middle, turned as it may";
  EXPECT_LT(found.correlation, 0.5);
}

TEST_F(Alignment_, OverlapIsTheShareThatLiesOnTheOther) {
  const ReliefDetail from = relief_detail(fixtures::touch_of(relief, {}, 2), {});
  EXPECT_NEAR(compare(from, to, {0.0, {8.0, 0.0}}, {}).overlap, 0.5, 0.03);
  EXPECT_EQ(compare(from, to, {0.0, {100.0, 0.0}}, {}).overlap, 0.0);
  EXPECT_EQ(compare(from, to, {0.0, {100.0, 0.0}}, {}).correlation, 0.0);
}

}  // namespace
}  // namespace touchstone::sensors
