#include "lab/dvs/dvs_recordings.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/units.h"
#include "lab/dvs/dvs_light.h"

namespace touchstone::lab {
namespace {

constexpr std::int64_t kCountUs = 1000;  // for which events are counted together

/// All kinds of event pixels, seeing the same light.
class Watch {
 public:
  Watch(const DvsRecordSettings& settings, cv::Size size, std::uint64_t noise_seed, const sim::EventSink& sink)
      : sink_(sink), recorded_(settings.pixels.size()) {
    sensors::EventWindowSettings windows;
    windows.length_us = kCountUs;
    windows.size = size;
    for (const render::EventPixelSettings& kind : settings.pixels) {
      pixels_.emplace_back(kind, size, settings.unit_seed, noise_seed);
      windows_.emplace_back(windows);
    }
  }

  void show(const cv::Mat& photocurrent, std::int64_t t_us) {
    ++steps_;
    for (std::size_t k = 0; k < pixels_.size(); ++k) {
      events_.clear();
      pixels_[k].advance(photocurrent, t_us, events_);
      windows_[k].add(events_);
      recorded_[k].events += static_cast<std::int64_t>(events_.size());
      if (k == 0 && sink_ && !events_.empty()) sink_(events_);
    }
  }

  std::int64_t steps() const { return steps_; }

  std::vector<DvsEvents> end(std::int64_t t_us) {
    for (std::size_t k = 0; k < pixels_.size(); ++k) {
      windows_[k].end_at(t_us);
      const auto finished = windows_[k].finished().first(static_cast<std::size_t>(t_us / kCountUs));
      recorded_[k].counts.assign(finished.begin(), finished.end());
    }
    return std::move(recorded_);
  }

 private:
  const sim::EventSink& sink_;
  std::vector<render::EventPixels> pixels_;
  std::vector<sensors::EventWindows> windows_;
  std::vector<DvsEvents> recorded_;
  std::vector<Event> events_;
  std::int64_t steps_ = 0;
};

std::int64_t microseconds(double seconds) {
  return std::llround(seconds * kMicrosecondsPerSecond);
}

/// Shows the light from one moment to the next: at the pictures' travels in between, and at the end.
void show_between(const sim::FingerMoment& before, const sim::FingerMoment& after, const DvsTravelLight& light,
                  Watch& watch) {
  const auto& travels = light.travels_mm();
  const auto begin = static_cast<double>(microseconds(before.seconds));
  const auto end = static_cast<double>(microseconds(after.seconds));
  std::vector<double> passed;
  const auto [low, high] = std::minmax(before.travel_mm, after.travel_mm);
  for (auto k = std::upper_bound(travels.begin(), travels.end(), low); k != travels.end() && *k < high; ++k) {
    passed.push_back(*k);
  }
  if (after.travel_mm < before.travel_mm) std::reverse(passed.begin(), passed.end());
  std::map<std::int64_t, double> shown;  // the last one of a microsecond
  for (const double travel : passed) {
    const double part = (travel - before.travel_mm) / (after.travel_mm - before.travel_mm);
    const auto t_us = static_cast<std::int64_t>(std::llround(begin + part * (end - begin)));
    if (t_us > microseconds(before.seconds) && t_us < microseconds(after.seconds)) shown[t_us] = travel;
  }
  for (const auto& [t_us, travel] : shown) watch.show(light.photocurrent_at(travel), t_us);
  watch.show(light.photocurrent_at(after.travel_mm), microseconds(after.seconds));
}

double smallest_threshold(const std::vector<render::EventPixelSettings>& kinds) {
  double smallest = kinds.front().on_threshold;
  for (const render::EventPixelSettings& kind : kinds) {
    smallest = std::min({smallest, kind.on_threshold, kind.off_threshold});
  }
  return smallest;
}

}  // namespace

DvsRecordSettings own_pixels(const sim::DeviceSpec& device) {
  if (!device.camera || !device.camera->events) {
    fail_at(device.where, "device {}: its camera has no event pixels (camera: events:)", device.name);
  }
  DvsRecordSettings settings;
  settings.pixels = {device.camera->events->pixels};
  return settings;
}

DvsRecording record_dvs_grasp(const DvsGraspSetup& setup, const sim::MembraneCamera& camera,
                              const DvsGraspParameters& parameters, const DvsRecordSettings& settings,
                              const sim::EventSink& sink) {
  if (settings.pixels.empty()) fail("a grasp's recording: no event pixels are given; at least one kind is needed");
  for (const render::EventPixelSettings& kind : settings.pixels) render::check(kind);
  if (!(settings.tolerance > 0.0 && settings.tolerance <= 0.5)) {
    fail("a grasp's recording: tolerance is {}; allowed is above 0 to 0.5", settings.tolerance);
  }
  const DvsGrasp grasp = setup.play(parameters, settings.force_sensor);
  const double allowed = settings.tolerance * smallest_threshold(settings.pixels);
  const DvsTravelLight light(setup, camera, grasp, settings.pixels.front(), allowed);

  const std::vector<sim::FingerMoment>& moments = grasp.run.moments;
  const cv::Mat first = light.photocurrent_at(moments.front().travel_mm);
  Watch watch(settings, first.size(), parameters.noise_seed, sink);
  watch.show(first, microseconds(moments.front().seconds));
  std::size_t shown = 0;  // the moment whose light was shown last
  for (std::size_t k = 1; k < moments.size(); ++k) {
    const double change = light.path_at(moments[k].travel_mm) - light.path_at(moments[shown].travel_mm);
    if (std::abs(change) < allowed && k + 1 < moments.size()) continue;
    // Until the moment before nothing worth a picture has changed.
    sim::FingerMoment before = moments[k - 1];
    if (k - 1 > shown) {
      before.travel_mm = moments[shown].travel_mm;
      watch.show(light.photocurrent_at(before.travel_mm), microseconds(before.seconds));
    }
    show_between(before, moments[k], light, watch);
    shown = k;
  }

  DvsRecording recording;
  recording.parameters = parameters;
  recording.by_pixels = watch.end(microseconds(moments.back().seconds));
  recording.readings = grasp.readings;
  recording.touch_s = grasp.run.first_touch_s;
  recording.release_s = grasp.run.release_s;
  recording.apart_s = grasp.run.apart_s;
  recording.pictures = static_cast<std::int64_t>(light.travels_mm().size());
  recording.steps = watch.steps();
  return recording;
}

std::vector<DvsRecording> record_dvs_grasps(const DvsGraspSetup& setup, const sim::MembraneCamera& camera,
                                            std::span<const DvsGraspParameters> grasps,
                                            const DvsRecordSettings& settings, const Progress& progress) {
  std::vector<DvsRecording> recordings(grasps.size());
  std::atomic<std::int64_t> done = 0;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, grasps.size(), 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t k = range.begin(); k != range.end(); ++k) {
          // A thread that waits for the rest of a picture's pixels takes no other grasp meanwhile.
          tbb::this_task_arena::isolate([&] { recordings[k] = record_dvs_grasp(setup, camera, grasps[k], settings); });
          if (progress) progress("grasps", ++done, static_cast<std::int64_t>(grasps.size()));
        }
      },
      tbb::simple_partitioner());
  return recordings;
}

std::vector<sensors::EventCounts> windows_of(const DvsEvents& events, int from_ms, int length_ms) {
  if (from_ms < 0) fail("windows of a recording: from_ms is {}; allowed is 0 or more", from_ms);
  if (length_ms < 1) fail("windows of a recording: length_ms is {}; allowed is 1 or more", length_ms);
  std::vector<sensors::EventCounts> windows;
  const auto length = static_cast<std::size_t>(length_ms);
  for (auto begin = static_cast<std::size_t>(from_ms); begin + length <= events.counts.size(); begin += length) {
    sensors::EventCounts& sum = windows.emplace_back();
    for (std::size_t k = begin; k < begin + length; ++k) {
      sum.on += events.counts[k].on;
      sum.off += events.counts[k].off;
    }
  }
  return windows;
}

}  // namespace touchstone::lab
