#include "lab/gelsight/gelsight_insertion_experiment.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"

namespace touchstone::lab {
namespace {

constexpr double kGripDepth_mm = 0.25;

/// Where the touch sensor sits in the hand, and the socket on the table: any poses do, both are known to the robot.
RigidTransform gripper_from_touch() {
  return {rotation_from_xyz({0.0, kPi / 2, 0.3}), {12.0, 0.0, 95.0}};
}
RigidTransform base_from_socket() {
  return {rotation_from_xyz({kPi / 2, 0.0, -0.4}), {600.0, -150.0, 220.0}};
}

Eigen::Vector2d robot_miss(const InsertionSettings& settings, std::uint64_t index) {
  RandomStream random(settings.seed, index, Purpose::kMotion);
  const double x = random.normal(), y = random.normal();
  return settings.robot_error_mm * Eigen::Vector2d(x, y);
}

/// One trial while it runs: the plug hangs still, the hand moves between grasps.
struct Reach {
  Grip hang;          // of the plug, relative to the hand's first place
  double hand = 0.0;  // across the plug
};

}  // namespace

RigidTransform in_space(const sensors::PlanarPose& pose) {
  RigidTransform space;
  space.rotation.topLeftCorner<2, 2>() = pose.rotation();
  space.translation.head<2>() = pose.translation;
  return space;
}

RigidTransform target_gripper(const RigidTransform& base_from_object_wanted, const RigidTransform& gripper_from_touch,
                              const RigidTransform& touch_from_object) {
  return base_from_object_wanted * (gripper_from_touch * touch_from_object).inverse();
}

int InsertionExperiment::successes() const {
  return static_cast<int>(std::count_if(trials.begin(), trials.end(), [](const auto& one) { return one.inserted; }));
}

int InsertionExperiment::grasps() const {
  return std::accumulate(trials.begin(), trials.end(), 0, [](int sum, const auto& one) { return sum + one.grasps; });
}

double mouth_error(const InsertionSettings& settings, const sensors::PlanarPose& touch_from_object_true,
                   const sensors::PlanarPose& touch_from_object_found, const Eigen::Vector2d& robot_error) {
  const RigidTransform wanted = base_from_socket();
  RigidTransform base_from_gripper = target_gripper(wanted, gripper_from_touch(), in_space(touch_from_object_found));
  base_from_gripper.translation += wanted.turn({robot_error.x(), robot_error.y(), 0.0});
  const RigidTransform base_from_object = base_from_gripper * gripper_from_touch() * in_space(touch_from_object_true);
  double worst = 0.0;
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d end(side * settings.mouth_half_width_mm, settings.mouth_y_mm, 0.0);
    worst = std::max(worst, (base_from_object * end - wanted * end).norm());
  }
  return worst;
}

InsertionExperiment run_insertion(const TouchSetup& setup, const sim::TouchObject& plug, const ObjectMap& map,
                                  const InsertionSettings& settings) {
  const auto trials = static_cast<std::size_t>(settings.trials);
  InsertionExperiment result;
  result.trials.resize(trials);
  std::vector<Reach> reaches(trials);
  for (std::size_t i = 0; i < trials; ++i) {
    reaches[i].hang = held({}, settings.hang, settings.seed, i);
    RandomStream random(settings.seed, i, Purpose::kMotion);
    reaches[i].hand = settings.reach_mm * (2.0 * random.uniform() - 1.0);
  }
  for (int grasp = 0; grasp < settings.most_grasps; ++grasp) {
    std::vector<std::size_t> open;
    std::vector<Grip> grips;
    for (std::size_t i = 0; i < trials; ++i) {
      if (result.trials[i].localised) continue;
      Grip middle = reaches[i].hang;
      middle.place_mm.x() -= reaches[i].hand;
      middle.depth_mm = kGripDepth_mm;
      grips.push_back(held(middle, settings.grasp, settings.seed + 1 + static_cast<std::uint64_t>(grasp), trials + i));
      open.push_back(i);
    }
    if (open.empty()) break;
    const std::uint64_t noise = settings.seed + 10000 * static_cast<std::uint64_t>(grasp + 1);
    const std::vector<TouchSample> touches = setup.touches(plug, grips, noise);
    for (std::size_t k = 0; k < open.size(); ++k) {
      InsertionTrial& trial = result.trials[open[k]];
      ++trial.grasps;
      trial.touch_from_object = touches[k].touch_from_object;
      const Localisation found = localise(map, touches[k]);
      if (!found.found()) {
        reaches[open[k]].hand += settings.search_mm[static_cast<std::size_t>(grasp) % settings.search_mm.size()];
        continue;
      }
      trial.localised = true;
      trial.estimated = found.touch_from_object;
      trial.error = found.error;
      const Eigen::Vector2d miss = robot_miss(settings, trials + open[k]);
      trial.error_mm = mouth_error(settings, trial.touch_from_object, trial.estimated, miss);
      trial.inserted = trial.error_mm < settings.tolerance_mm;
    }
  }
  return result;
}

double successes_with_robot_error(const InsertionExperiment& done, const InsertionSettings& settings, int rounds) {
  TS_ASSERT(rounds > 0);
  int successes = 0;
  std::uint64_t draw = 1U << 20U;
  for (int round = 0; round < rounds; ++round) {
    for (const InsertionTrial& trial : done.trials) {
      const Eigen::Vector2d miss = robot_miss(settings, ++draw);
      if (!trial.localised) continue;
      successes += mouth_error(settings, trial.touch_from_object, trial.estimated, miss) < settings.tolerance_mm;
    }
  }
  return static_cast<double>(successes) / rounds;
}

}  // namespace touchstone::lab
