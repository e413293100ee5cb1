// What events cost.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <tuple>

#include "core/error.h"
#include "core/seconds_since.h"
#include "lab/bench/device_bench_parts.h"
#include "sim/plan/plan.h"
#include "sim/sensor/event_stream.h"

namespace touchstone::lab {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array kEventSteps = {4.0, 2.0, 1.0, 0.5, 0.25, 0.125};
constexpr int kFewestEventPixels = 16 * 16;
constexpr double kSameEvent_us = 1000.0;

/// Part of the true events that are missing among the others, that they have too many of, or have at another time: the
/// k-th event of a pixel and a sign is the other's k-th.
double event_difference(const std::vector<Event>& events, const std::vector<Event>& truth) {
  using Key = std::tuple<int, int, bool>;
  std::map<Key, std::array<std::vector<std::int64_t>, 2>> times;
  for (const Event& event : events) times[{event.y, event.x, event.on}][0].push_back(event.t_us);
  for (const Event& event : truth) times[{event.y, event.x, event.on}][1].push_back(event.t_us);
  std::int64_t wrong = 0;
  for (const auto& [key, both] : times) {
    const std::size_t common = std::min(both[0].size(), both[1].size());
    wrong += static_cast<std::int64_t>(std::max(both[0].size(), both[1].size()) - common);
    for (std::size_t k = 0; k < common; ++k) {
      if (std::abs(static_cast<double>(both[0][k] - both[1][k])) > kSameEvent_us) ++wrong;
    }
  }
  return static_cast<double>(wrong) / static_cast<double>(std::max<std::size_t>(1, truth.size()));
}

struct WatchedEvents {
  std::vector<Event> events;
  double seconds = 0.0;
  std::int64_t pictures = 0;
};

WatchedEvents watch(sim::SceneSpec scene, const fem::Compliance& gel, double step) {
  scene.light.event_step = step;
  scene.light.event_reach_px = 0.0;  // the step is that of pictures drawn in full
  const sim::Plan plan = sim::make_plan(scene);
  WatchedEvents watched;
  const auto begun = Clock::now();
  watched.pictures = sim::watch_events(scene, plan, gel, scene.seed, [&](std::span<const Event> more) {
                       watched.events.insert(watched.events.end(), more.begin(), more.end());
                     }).pictures;
  watched.seconds = seconds_since(begun);
  return watched;
}

/// A setting of each step, until one would take too long. The finest is what the others are held against.
void watch_in_steps(const BenchParts& parts, sim::SceneSpec scene, const Progress& progress, BenchCurve& curve) {
  // What the finest step takes with few pixels says how many may be had: for half of the limit, as it's a guess.
  const sim::DeviceSpec whole = scene.device;
  scene.device = middle_of(whole, kFewestEventPixels);
  if (progress) progress("event step", 0, kEventSteps.size());
  const double pilot_s = watch(scene, parts.own_gel, kEventSteps.back()).seconds;
  const double pixels = kFewestEventPixels * std::max(1.0, 0.5 * kMostSeconds / pilot_s);
  scene.device = middle_of(whole, static_cast<int>(std::min(pixels, 1e9)));

  std::vector<WatchedEvents> watched;
  for (const double step : kEventSteps) {
    BenchPoint point;
    point.setting = fmt::format("light.event_step {}", step);
    point.value = step;
    point.as_is = step == sim::LightSpec{}.event_step;
    if (watched.size() > 1 && 2.0 * watched.back().seconds > kMostSeconds) {
      point.note = fmt::format("left out: it would take some {:.0f} s", 2.0 * watched.back().seconds);
      curve.points.push_back(point);
      break;
    }
    if (progress) progress("event step", static_cast<std::int64_t>(watched.size()), kEventSteps.size());
    watched.push_back(watch(scene, parts.own_gel, step));
    point.each_s = watched.back().seconds;
    point.work = static_cast<double>(watched.back().pictures);
    curve.points.push_back(point);
  }
  const std::vector<Event>& truth = watched.back().events;
  for (std::size_t k = 0; k + 1 < watched.size(); ++k) {
    curve.points[k].event_error = event_difference(watched[k].events, truth);
  }
  BenchPoint& finest = curve.points[watched.size() - 1];
  finest.note = "the reference";
  curve.what +=
      fmt::format(" {} x {} pixels, {} events.", scene.device.camera->width, scene.device.camera->height, truth.size());
}

}  // namespace

BenchCurve events_curve(const BenchParts& parts, const Progress& progress) {
  BenchCurve curve;
  curve.name = "event step";
  curve.what = fmt::format(
      "What event pixels may change by from one picture to the next, as a part of the smallest threshold, against the "
      "finest here. An event counts as wrong if it's missing, too many or more than {:.0f} us off.",
      kSameEvent_us);
  curve.each = "the whole press, s";
  curve.work = "pictures";
  sim::SceneSpec scene = bench_scene(parts.device, parts.presses, parts.presses.specs.front(), parts.settings.seed);
  scene.outputs = {};
  scene.outputs.frames = false;
  scene.outputs.events = true;
  try {
    watch_in_steps(parts, scene, progress, curve);
  } catch (const Error& error) {
    curve.what += fmt::format(" Can't be had: {}", error.what());
  }
  return curve;
}

}  // namespace touchstone::lab
