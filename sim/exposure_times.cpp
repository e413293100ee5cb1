#include "sim/exposure_times.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "sim/image_motion.h"
#include "sim/state_between.h"

namespace touchstone::sim {
namespace {

constexpr double kPixelsApart = 0.5;  // light is taken as linear in time between moments that far apart
constexpr int kMostIntervals = 64;

}  // namespace

std::int64_t frame_time_us(int frame, double frame_rate_Hz) {
  return static_cast<std::int64_t>(std::llround(frame * kMicrosecondsPerSecond / frame_rate_Hz));
}

double exposure_window_s(const SceneSpec& scene, const Plan& plan) {
  double window_us = 0.0;
  if (plan.motion_blur) window_us += scene.device.camera->exposure_us;
  if (plan.rolling_shutter) window_us += scene.device.camera->row_time_us * (scene.device.camera->height - 1);
  return window_us / kMicrosecondsPerSecond;
}

void keep_within_exposures(std::vector<Truth>& truths, double now_s, double window_s, double frame_rate_Hz,
                           const fem::PressState& state) {
  if (window_s == 0.0) return;
  std::shared_ptr<const fem::PressState> shared;
  for (auto truth = truths.rbegin(); truth != truths.rend(); ++truth) {
    if (!truth->later.empty() && truth->later.back().after_s >= window_s) break;  // as those before it
    if (!shared) shared = std::make_shared<const fem::PressState>(state);
    truth->later.push_back({now_s - truth->frame / frame_rate_Hz, shared});
  }
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

std::vector<double> exposure_times(const SceneSpec& scene, const Truth& truth, double window_s) {
  const ImageScale scale(scene.device);
  const double radius = largest_object_radius(scene);
  double pixels = 0.0;
  const fem::PressState* before = &truth.press;
  double before_s = 0.0;
  for (const LaterState& later : truth.later) {
    const double part = std::clamp((window_s - before_s) / (later.after_s - before_s), 0.0, 1.0);
    pixels += part * image_motion(scale, *before, *later.press, radius);
    before = later.press.get();
    before_s = later.after_s;
  }
  if (pixels <= scene.light.motion_tolerance_px) return {0.0};
  const int intervals = std::clamp(static_cast<int>(std::ceil(pixels / kPixelsApart)), 1, kMostIntervals);
  std::vector<double> times;
  for (int i = 0; i <= intervals; ++i) times.push_back(window_s * i / intervals);
  return times;
}

}  // namespace touchstone::sim
