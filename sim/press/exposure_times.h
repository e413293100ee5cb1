#pragma once
// The moments between frames that a camera's exposure takes light from.

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/plan/image_motion.h"
#include "sim/plan/plan.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// When frame number `frame` begins, in whole microseconds.
std::int64_t frame_time_us(int frame, double frame_rate_Hz);

/// The state `after_s` after a frame's begin, straight between those that are known; after the motion's end its last.
fem::PressState state_after(const Truth& truth, double after_s);

/// What a scene's exposures need of its motion.
class ExposureTimes {
 public:
  /// Of one scene, by its plan: which of blur and rolling shutter are simulated.
  ExposureTimes(const SceneSpec& scene, const Plan& plan);

  /// How long a frame gathers light, s: the exposure, if its blur is simulated, and what the last row lags behind the
  /// first, if that is; 0 if neither.
  double window_s() const { return window_s_; }

  /// Hands the state at `now_s`, played next, to all frames before it whose exposure it is wanted for (Truth::later).
  /// Frames in whose exposure nothing moves get none.
  void keep(std::vector<Truth>& truths, double now_s, const fem::PressState& state) const;

  /// The moments, s after a frame's begin, at which its light is computed: evenly over the window, so densely that
  /// nothing moves more than a quarter of a pixel (of what a point's image is wide, if that is more) from one to the
  /// next, at least two and at most 65. A single one, the begin, where nothing moves by more than the scene's
  /// `light.motion_tolerance_px` (times that width, for motion blur that the scene doesn't force).
  std::vector<double> of(const Truth& truth) const;

 private:
  /// How far at most something moves in the picture while the frame gathers light.
  double pixels(const Truth& truth) const;

  double window_s_ = 0.0;
  double frame_rate_Hz_ = 0.0;
  double between_states_s_ = 0.0;
  double tolerance_px_ = 0.0;
  double apart_px_ = 0.0;
  double object_radius_mm_ = 0.0;
  std::optional<ImageScale> scale_;  // where the window isn't 0
};

}  // namespace touchstone::sim
