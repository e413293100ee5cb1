#include "sim/press/exposure_times.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "sim/plan/image_motion.h"
#include "sim/press/state_between.h"

namespace touchstone::sim {
namespace {

constexpr double kPixelsApart = 0.25;  // light is taken as linear in time between moments so far apart, if sharp
constexpr int kMostIntervals = 64;

}  // namespace

std::int64_t frame_time_us(int frame, double frame_rate_Hz) {
  return static_cast<std::int64_t>(std::llround(frame * kMicrosecondsPerSecond / frame_rate_Hz));
}

fem::PressState state_after(const Truth& truth, double after_s) {
  TS_ASSERT(after_s >= 0.0);
  double before_s = 0.0;
  const fem::PressState* before = &truth.press;
  for (const LaterState& later : truth.later) {
    if (later.after_s >= after_s) {
      return state_between(*before, *later.press, (after_s - before_s) / (later.after_s - before_s));
    }
    before_s = later.after_s;
    before = later.press.get();
  }
  return *before;
}

ExposureTimes::ExposureTimes(const SceneSpec& scene, const Plan& plan)
    : frame_rate_Hz_(scene.motion.frame_rate_Hz), tolerance_px_(scene.light.motion_tolerance_px) {
  double window_us = 0.0;
  if (plan.motion_blur) window_us += scene.device.camera->exposure_us;
  if (plan.rolling_shutter) window_us += scene.device.camera->row_time_us * (scene.device.camera->height - 1);
  window_s_ = window_us / kMicrosecondsPerSecond;
  if (window_s_ == 0.0) return;
  between_states_s_ = 1.0 / (frame_rate_Hz_ * plan.states_a_frame);
  scale_.emplace(scene.device);
  const bool own_choice = !plan.rolling_shutter && scene.effects.motion_blur == Switch::automatic;
  if (own_choice) tolerance_px_ *= scale_->point_width();
  apart_px_ = kPixelsApart * (plan.rolling_shutter ? 1.0 : scale_->point_width());
  object_radius_mm_ = largest_object_radius(scene);
}

void ExposureTimes::keep(std::vector<Truth>& truths, double now_s, const fem::PressState& state) const {
  if (window_s_ == 0.0) return;
  const double enough_s = (1.0 - 1e-9) * window_s_;  // times are sums of rounded numbers
  std::shared_ptr<const fem::PressState> shared;
  for (auto truth = truths.rbegin(); truth != truths.rend(); ++truth) {
    const double after_s = now_s - truth->frame / frame_rate_Hz_;
    const bool whole = after_s - between_states_s_ >= enough_s;  // with the state before this one
    if (whole) break;                                            // and so are those before it
    if (!shared) shared = std::make_shared<const fem::PressState>(state);
    truth->later.push_back({after_s, shared});
    if (after_s >= enough_s && pixels(*truth) <= tolerance_px_) truth->later.clear();
  }
}

double ExposureTimes::pixels(const Truth& truth) const {
  double pixels = 0.0;
  const fem::PressState* before = &truth.press;
  double before_s = 0.0;
  for (const LaterState& later : truth.later) {
    const double part = std::clamp((window_s_ - before_s) / (later.after_s - before_s), 0.0, 1.0);
    pixels += part * image_motion(*scale_, *before, *later.press, object_radius_mm_);
    before = later.press.get();
    before_s = later.after_s;
  }
  return pixels;
}

std::vector<double> ExposureTimes::of(const Truth& truth) const {
  if (window_s_ == 0.0) return {0.0};
  const double moved = pixels(truth);
  if (moved <= tolerance_px_) return {0.0};
  const int intervals = std::clamp(static_cast<int>(std::ceil(moved / apart_px_)), 1, kMostIntervals);
  std::vector<double> times;
  for (int i = 0; i <= intervals; ++i) times.push_back(window_s_ * i / intervals);
  return times;
}

}  // namespace touchstone::sim
