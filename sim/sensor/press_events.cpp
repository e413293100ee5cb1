#include "sim/sensor/press_events.h"

#include <algorithm>

#include "core/error.h"
#include "sim/press/state_between.h"

namespace touchstone::sim {
namespace {

constexpr double kStep = 0.5;        // of the smallest threshold, from picture to picture
constexpr int kMostPictures = 8;     // between two states
constexpr int kSettlingFrames = 64;  // a shutter goes by 1/16 a frame: 64 frames are a factor of 48

}  // namespace

std::vector<Event> events_of_press(std::span<const Truth> states, const Photocurrent& light,
                                   const render::EventPixelSettings& pixels, std::uint64_t unit_seed,
                                   std::uint64_t noise_seed) {
  TS_ASSERT(!states.empty());
  std::vector<Event> events;
  cv::Mat before = light(states.front().press);
  render::EventPixels watch(pixels, before.size(), unit_seed, noise_seed);
  watch.advance(before, states.front().t_us, events);
  const double largest = kStep * std::min(pixels.on_threshold, pixels.off_threshold);
  for (std::size_t k = 1; k < states.size(); ++k) {
    const cv::Mat after = light(states[k].press);
    const int wanted =
        render::needed_subdivisions(log_intensity(before, pixels), log_intensity(after, pixels), largest);
    const int pictures = std::clamp(wanted, 0, kMostPictures);
    const std::int64_t begin_us = states[k - 1].t_us;
    const std::int64_t length_us = states[k].t_us - begin_us;
    for (int i = 1; i <= pictures; ++i) {
      const double part = static_cast<double>(i) / (pictures + 1);
      const std::int64_t t_us = begin_us + static_cast<std::int64_t>(part * static_cast<double>(length_us));
      if (t_us <= begin_us || t_us >= states[k].t_us) continue;
      watch.advance(light(state_between(states[k - 1].press, states[k].press, part)), t_us, events);
    }
    watch.advance(after, states[k].t_us, events);
    before = after;
  }
  return events;
}

std::vector<Event> events_of_press(std::span<const Truth> states, const LightOfKeys& light, const fem::Compliance& gel,
                                   const render::EventPixelSettings& pixels, std::uint64_t unit_seed,
                                   std::uint64_t noise_seed) {
  TS_ASSERT(!states.empty());
  std::vector<Event> events;
  const CameraSpec& camera = *light.view.scene.device.camera;
  render::EventPixels watch(pixels, {camera.width, camera.height}, unit_seed, noise_seed);
  LightBetween between(light, gel,
                       [&](std::int64_t t_us, const cv::Mat& currents) { watch.advance(currents, t_us, events); });
  for (const Truth& state : states) between.add(state.t_us, state.press);
  between.finish();
  return events;
}

ChipTouch chip_touch(const render::MotionChipSettings& settings, const cv::Mat& rest_light,
                     std::span<const cv::Mat> lights, std::uint64_t unit_seed, std::uint64_t noise_seed) {
  render::MotionChip chip(settings, unit_seed, noise_seed);
  for (int frame = 0; frame < kSettlingFrames; ++frame) chip.expose(rest_light);
  ChipTouch touch;
  int dx = 0;
  int dy = 0;
  const auto show = [&](const cv::Mat& light) {
    const render::ChipFrame frame = chip.expose(light);
    dx += frame.statistics.dx;
    dy += frame.statistics.dy;
    touch.raw = frame.raw;
    touch.statistics = frame.statistics;
  };
  for (const cv::Mat& light : lights) show(light);
  const cv::Mat& last = lights.empty() ? rest_light : lights.back();
  for (int frame = 0; frame < kSettlingFrames; ++frame) show(last);
  touch.statistics.dx = dx;
  touch.statistics.dy = dy;
  return touch;
}

}  // namespace touchstone::sim
