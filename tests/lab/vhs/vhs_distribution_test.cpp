#include "lab/vhs/vhs_distribution.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "core/whole_file.h"
#include "lab/vhs/bead_tractions.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using touchstone::test::message_of;

sim::DeviceSpec vhs() {
  return sim::read_device(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes" / "devices" / "vhs.yaml");
}

/// The sensor with more beads, and a coarse mesh, made once.
const DistributionSetup& setup() {
  static const test::TemporaryFolder cache;
  static const DistributionSetup made = [] {
    sim::DeviceSpec device = vhs();
    device.mesh.fine_mm = 0.6;  // 0.8 is the contact itself: 0.80 N of 0.7 are then found
    return set_up_distribution(device, 5, 1.5, cache.path());
  }();
  return made;
}

TEST(BeadParallax, IsWhatAPinholeThroughGlassAndGelSees) {
  // 15.4 mm of air, 2 mm of glass of 1.517, 4.55 mm of gel of 1.48 before the beads.
  EXPECT_NEAR(bead_parallax(vhs()).viewing_distance_mm, 1.48 * (15.4 + 2.0 / 1.517) + 4.55, 1e-9);
  const DistributionSetup& b = setup();
  // A bead at 3 mm that is pressed by 0.1 mm looks shifted by 3 * 0.1 / 29.3 mm; the faces' own answer agrees.
  const sensors::BeadView view = sensors::view_of(b.rest_px, b.compliance);
  EXPECT_LT(view.rms_px, 0.3);
  EXPECT_NEAR(view.px_per_mm, 36.7, 0.5);  // 73 px for 2 mm (scenes/devices/vhs.yaml)
}

TEST(BeadParallax, OtherDevicesAreRefused) {
  sim::DeviceSpec device = vhs();
  device.camera->look_at_mm.x() += 1.0;
  EXPECT_THAT(message_of([&] { bead_parallax(device); }), HasSubstr("straight"));
  device = vhs();
  device.camera->optics = sim::LensSpec{};
  EXPECT_THAT(message_of([&] { bead_parallax(device); }), HasSubstr("no pinhole"));
  device.beads.reset();
  EXPECT_THAT(message_of([&] { bead_parallax(device); }), HasSubstr("no beads"));
}

TEST(VhsDistribution, TwoForcesAtOnceAreSeparated) {
  sensors::TractionInversion inversion(setup().compliance, bead_inversion());
  const std::vector<LoadPoint> points = {{{-1.6, 0.2}, 0.7}, {{1.5, -0.4}, 0.3}};
  const DistributionTrial trial = press_points(setup(), inversion, points, 0.1, 1);
  EXPECT_NEAR(trial.true_total_N, 1.0, 1e-5);
  EXPECT_NEAR(trial.estimated_N[0], 0.7, 0.1);
  EXPECT_NEAR(trial.estimated_N[1], 0.3, 0.1);
  EXPECT_LT(trial.place_mm[0], 0.4);
  EXPECT_LT(trial.place_mm[1], 0.4);
  EXPECT_LT(trial.dip, 0.5);
  const DistributionTrial near = press_points(setup(), inversion, {{{-0.4, 0.0}, 0.5}, {{0.4, 0.0}, 0.5}}, 0.1, 1);
  EXPECT_NEAR(near.total_N, 1.0, 0.15);
  EXPECT_GT(near.dip, 0.75) << "0.8 mm are half of the beads' spacing";
}

TEST(BeadTractions, TablesSumToTheForces) {
  const sensors::MarkerCompliance& map = setup().compliance;
  // Beads as a pressure of 0.03 MPa on the nine patches in the middle, with shear, moves them.
  Eigen::Matrix3Xd traction = Eigen::Matrix3Xd::Zero(3, map.patches());
  for (int p = 0; p < map.patches(); ++p) {
    if (map.patch_centre(p).cwiseAbs().maxCoeff() < 1.4 * map.patch_side) traction.col(p) << 0.005, 0.0, -0.03;
  }
  const sensors::MarkerField moved = sensors::displacements_under(map, traction);
  const double px_per_mm = sensors::view_of(setup().rest_px, map).px_per_mm;
  TrackedSequence sequence;
  sequence.source.name = "press";
  for (int frame = 0; frame < 3; ++frame) {
    datasets::LabelledFrame& labelled = sequence.source.frames.emplace_back();
    labelled.frame = frame;
    sensors::TrackedBeads& beads = sequence.beads.emplace_back();
    beads.t_us = 1000 * frame;
    beads.positions = setup().rest_px;
    beads.status.assign(25, frame < 2 ? sensors::BeadStatus::kFound : sensors::BeadStatus::kHidden);
    for (std::size_t i = 0; i < 25 && frame == 1; ++i)
      beads.positions[i] += px_per_mm * moved.displacement[i].head<2>();
  }
  const test::TemporaryFolder folder;
  const TractionSummary summary =
      write_bead_tractions({sequence}, {}, map, {}, bead_inversion(), folder.path() / "out");
  EXPECT_EQ(summary.frames, 3);
  EXPECT_EQ(summary.in_contact, 1);
  EXPECT_EQ(summary.without_force, 1);

  std::istringstream forces(read_whole_file(folder.path() / "out" / "forces.csv"));
  std::string header, rest, pressed, hidden;
  std::getline(forces, header);
  std::getline(forces, rest);
  std::getline(forces, pressed);
  std::getline(forces, hidden);
  EXPECT_THAT(header, StartsWith("sequence,frame,t_us,beads,force_x_N"));
  EXPECT_THAT(rest, StartsWith("press,0,0,25,0.00000,0.00000,0.00000"));
  EXPECT_EQ(hidden, "press,2,2000,0,,,,,,");
  const double area = 9.0 * map.patch_area();
  double x = 0.0, y = 0.0, z = 0.0;
  ASSERT_EQ(std::sscanf(pressed.c_str(), "press,1,1000,25,%lf,%lf,%lf", &x, &y, &z), 3) << pressed;
  EXPECT_NEAR(z, 0.03 * area, 0.1 * 0.03 * area);
  EXPECT_NEAR(x, -0.005 * area, 0.2 * 0.005 * area);

  std::istringstream tractions(read_whole_file(folder.path() / "out" / "tractions.csv"));
  double sum = 0.0;
  std::getline(tractions, header);
  for (std::string line; std::getline(tractions, line);) sum += std::stod(line.substr(line.rfind(',') + 1));
  EXPECT_NEAR(sum * map.patch_area(), z, 1e-3);

  sequence.beads[0].status[3] = sensors::BeadStatus::kReset;
  EXPECT_THAT(message_of([&] { write_bead_tractions({sequence}, {}, map, {}, bead_inversion(), folder.path()); }),
              HasSubstr("press: its first frame, without load, shows 24 of 25 beads"));
}

}  // namespace
}  // namespace touchstone::lab
