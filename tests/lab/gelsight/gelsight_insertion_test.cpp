#include "lab/gelsight/gelsight_insertion_experiment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/units.h"

namespace touchstone::lab {
namespace {

/// Eq. 3: with the gripper at its target the object is where it is wanted.
TEST(Insertion, TheTargetPutsTheObjectWhereItIsWanted) {
  const RigidTransform wanted{rotation_from_xyz({0.3, -1.0, 2.0}), {400, 20, 90}};
  const RigidTransform gripper_from_touch{rotation_from_xyz({0, 1.2, 0}), {10, 0, 80}};
  const RigidTransform touch_from_object = in_space({0.4, {2.0, -3.0}});
  const RigidTransform back =
      target_gripper(wanted, gripper_from_touch, touch_from_object) * gripper_from_touch * touch_from_object;
  EXPECT_LT((back.rotation - wanted.rotation).norm(), 1e-12);
  EXPECT_LT((back.translation - wanted.translation).norm(), 1e-10);
}

TEST(Insertion, AWrongPoseMissesByItsOwnError) {
  const InsertionSettings settings;
  const sensors::PlanarPose pose{0.1, {1.0, 2.0}};
  EXPECT_NEAR(mouth_error(settings, pose, pose, {0, 0}), 0.0, 1e-10);
  EXPECT_NEAR(mouth_error(settings, pose, pose, {0.3, -0.4}), 0.5, 1e-10) << "the robot's own";
  const sensors::PlanarPose aside{0.1, {1.3, 1.6}};
  EXPECT_NEAR(mouth_error(settings, pose, aside, {0, 0}), 0.5, 1e-10);
  // Turned by a degree about the object's origin: the mouth's ends are sqrt(6^2 + 6^2) mm away from it.
  const sensors::PlanarPose turned{0.1 + kRadiansPerDegree, {1.0, 2.0}};
  EXPECT_NEAR(mouth_error(settings, pose, turned, {0, 0}), 2.0 * std::sqrt(72.0) * std::sin(0.5 * kRadiansPerDegree),
              1e-9);
}

TEST(Insertion, ARobotThatMissesFailsAsOftenAsRayleighSays) {
  InsertionExperiment done;
  done.trials.resize(36);
  for (InsertionTrial& trial : done.trials) trial.localised = true;
  done.trials.back().localised = false;
  InsertionSettings settings;
  settings.robot_error_mm = 0.5;
  EXPECT_NEAR(successes_with_robot_error(done, settings, 2000), 35.0 * (1.0 - std::exp(-2.0)), 0.2);
  settings.robot_error_mm = 0.0;
  EXPECT_EQ(successes_with_robot_error(done, settings, 1), 35.0);
}

TEST(SeriesError, MeansAreOverTouchesAndDeviationsOverSettings) {
  const double lost = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::vector<double>> values = {{1.0, 3.0}, {-2.0, -2.0}, {lost, 4.0}};
  const SeriesError error = series_error(values);
  EXPECT_EQ(error.touches, 6);
  EXPECT_EQ(error.lost, 1);
  EXPECT_NEAR(error.mean_absolute, 12.0 / 5.0, 1e-12);
  EXPECT_NEAR(error.mean_deviation, 0.5 * std::sqrt(2.0), 1e-12);
}

TEST(GripPlay, StaysWithinItsBoundsAndRepeats) {
  const GripPlay play{{0.5, 0.0}, 0.1, 0.01, 0.05};
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Grip grip = held({}, play, 7, i), again = held({}, play, 7, i);
    EXPECT_LE(std::abs(grip.place_mm.x()), 0.5);
    EXPECT_EQ(grip.place_mm.y(), 0.0);
    EXPECT_LE(std::abs(grip.angle), 0.1);
    EXPECT_LE(grip.tilt.cwiseAbs().maxCoeff(), 0.01);
    EXPECT_EQ(grip.place_mm.x(), again.place_mm.x());
  }
}

}  // namespace
}  // namespace touchstone::lab
