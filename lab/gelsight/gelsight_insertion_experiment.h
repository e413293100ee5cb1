#pragma once
// Inserting a plug by touch [Li2015, sec. 3.4]: a robot grasps a plug that hangs somehow in a jig, finds by touch how
// it holds it, and moves the gripper so that the plug hovers over its socket.
//
// Frames: base (the robot's), gripper, touch (the sensor's, sensors/touch_map/touch_image.h, fixed to the gripper),
// object (the plug's: centred on its face, x across, y along it, mouth at -y; sim/relief/plug_relief.h). The hand
// closes sideways, so all that is unknown happens in the plane of the touch.

#include <cstdint>
#include <vector>

#include "core/transform.h"
#include "lab/gelsight/gelsight_map_experiment.h"

namespace touchstone::lab {

/// The gripper's target (eq. 3): base_from_gripper* = base_from_object* (gripper_from_touch touch_from_object)^-1. The
/// thesis's gTm and mTo are gripper_from_touch and touch_from_object.
RigidTransform target_gripper(const RigidTransform& base_from_object_wanted, const RigidTransform& gripper_from_touch,
                              const RigidTransform& touch_from_object);

/// A pose of the touch's plane in space.
RigidTransform in_space(const sensors::PlanarPose& pose);

/// How plugs hang, how the hand errs, and what counts as inserted.
struct InsertionSettings {
  int trials = 36;
  int most_grasps = 6;  ///< of a trial; then it has failed
  std::uint64_t seed = 34;
  /// How the plug hangs, uniform: the thesis's fig. 3-7 shows 3.5 mm by 3 mm (0.005 mm a pixel).
  GripPlay hang = {{1.75, 1.5}, 0.175, 0.0, 0.0};
  /// Ours: how far across the plug the hand misses it at the first reach, uniform. So far that some are held by an edge
  /// only, since else the thesis's search would have nothing to do.
  double reach_mm = 8.0;
  GripPlay grasp = {{0.0, 0.0}, 0.0, 0.0044, 0.05};  ///< tilt (radians) and depth (mm) of each grasp
  /// The blind search across the plug: the hand's steps after a grasp that wasn't localised, over and over: 0.75 cm
  /// forward, 1.5 cm back (sec. 3.4.4), and forward again to where it began.
  std::vector<double> search_mm = {7.5, -15.0, 7.5};
  /// Standard deviation of where the hand stops, along each axis of the plane. The thesis suspects its two failures of
  /// it.
  double robot_error_mm = 0.0;
  double tolerance_mm = 1.0;  ///< of each end of the plug's mouth from where it should be
  double mouth_half_width_mm = 6.0, mouth_y_mm = -6.0;
};

/// One plug, from the first grasp to the socket.
struct InsertionTrial {
  int grasps = 0;
  bool localised = false;
  sensors::PlanarPose touch_from_object;  ///< true, of the last grasp
  sensors::PlanarPose estimated;          ///< the same as it was localised
  double error_mm = 0.0;                  ///< of the worse end of the plug's mouth over the socket
  double error = 0.0;                     ///< of its angle, radians
  bool inserted = false;
};

/// All trials.
struct InsertionExperiment {
  std::vector<InsertionTrial> trials;
  /// How many plugs were inserted.
  int successes() const;
  int grasps() const;  ///< of all trials: one each, and one more for each grasp that wasn't localised
};

/// Where the plug's mouth ends up, judged in space. `robot_error` moves the gripper from its target, base frame.
double mouth_error(const InsertionSettings& settings, const sensors::PlanarPose& touch_from_object_true,
                   const sensors::PlanarPose& touch_from_object_found, const Eigen::Vector2d& robot_error);

/// Grasps plugs that hang at random, localises each grasp on the map, and moves the plug over the socket.
InsertionExperiment run_insertion(const TouchSetup& setup, const sim::TouchObject& plug, const ObjectMap& map,
                                  const InsertionSettings& settings);

/// The same grasps and poses with a robot that stops elsewhere: successes as settings.robot_error_mm has it, averaged
/// over `rounds` draws of it.
double successes_with_robot_error(const InsertionExperiment& done, const InsertionSettings& settings, int rounds);

}  // namespace touchstone::lab
