#pragma once
// Force from events as they come, a window after the other: the scene at rest first, then first touch, from which on
// counts are accumulated [Naeini2020, sec. III.B to III.D]. One object reads one grasp.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sensors/events/event_windows.h"
#include "sensors/events/grasp_force_model.h"
#include "sensors/events/grasp_phases.h"

namespace touchstone::sensors {

/// One window's answer.
struct WindowForce {
  std::int64_t end_us = 0;        ///< of the window
  EventCounts counts;             ///< in it
  bool touched = false;           ///< it's first touch's window or a later one
  double force_N = 0.0;           ///< 0 before the touch
  std::optional<double> sigma_N;  ///< standard error; none before touch, and of a network never tried on other grasps
  bool extrapolates = false;      ///< more events, or longer in touch, than in training: the force is a guess
};

/// Takes one grasp's events and answers for each window that is over.
class GraspForceReader {
 public:
  /// @param windows their length must be the one that the model was trained with
  /// @throws Error for a faulty model, and as EventWindows
  GraspForceReader(GraspForceModel model, const EventWindowSettings& windows, const GraspPhaseSettings& phases = {});

  /// Takes the next events, in order of time. @throws Error as EventWindows::add; windows before that event are
  /// answered
  void add(std::span<const Event> events);
  /// Says that no event before `t_us` is to come. @throws Error as EventWindows::end_at
  void end_at(std::int64_t t_us);

  /// The windows that are over, from the first one on.
  std::span<const WindowForce> forces() const { return forces_; }
  /// OFF events that a window needs to be first touch; none while the scene at rest is still looked at.
  std::optional<std::int64_t> touch_threshold() const { return threshold_; }

 private:
  void answer();
  void estimate(WindowForce& window);

  EventWindowSettings window_settings_;
  GraspPhaseSettings phases_;
  EventWindows windows_;
  GraspForceModel model_;
  std::optional<TimeDelayEstimator> network_;       ///< the model's, if it is one
  Eigen::Vector3d most_ = Eigen::Vector3d::Zero();  ///< of the process' inputs
  std::optional<std::int64_t> threshold_;
  std::vector<WindowForce> forces_;
  std::int64_t on_ = 0, off_ = 0, since_touch_ = 0;  ///< accumulated; windows
};

}  // namespace touchstone::sensors
