// Frames a second of the bead tracker on one core, alone, with the force and drawn for a window, and on all cores,
// beside OpenCV's SimpleBlobDetector on the same frames (the peer that [VisioHaptic2024] names). 719 frames/s is the
// paper's own figure.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/random.h"
#include "sensors/beads/bead_overlay.h"
#include "sensors/beads/bead_tracker.h"
#include "sensors/beads/stiffness_force_model.h"

namespace touchstone::sensors {
namespace {

constexpr int kFrames = 32;
constexpr std::int64_t kIntervalUs = 1663;  // 601.25 frames/s

/// Dark discs on a noisy, bright, 640 x 480 background, which sway by a few px over the 32 frames.
struct Clip {
  BeadTrackerSettings settings;
  double radius_px = 9.0;
  std::vector<cv::Mat> images;
};

Clip make_clip(int grid, bool colour) {
  Clip clip;
  clip.settings.grid = grid;
  double spacing = 70.0;
  if (grid > 3) {
    clip.settings.roi_a_px = 44 * grid;
    clip.settings.roi_b_px = 20;
    spacing = 43.0;
    clip.radius_px = 5.0;
  }
  RandomStream random(1, 0, Purpose::kTest);
  for (int frame = 0; frame < kFrames; ++frame) {
    cv::Mat image(480, 640, CV_8U, cv::Scalar(170));
    const double phase = 2.0 * 3.14159265358979323846 * frame / kFrames;
    const double x0 = 320.0 - 0.5 * spacing * (grid - 1) + 3.0 * std::sin(phase);
    const double y0 = 240.0 - 0.5 * spacing * (grid - 1) + 3.0 * std::cos(phase);
    constexpr int kShift = 6;  // fractional bits of OpenCV's drawing coordinates
    for (int i = 0; i < grid * grid; ++i) {
      const cv::Point centre(static_cast<int>(std::lround((x0 + spacing * (i % grid) - 0.5) * (1 << kShift))),
                             static_cast<int>(std::lround((y0 + spacing * (i / grid) - 0.5) * (1 << kShift))));
      cv::circle(image, centre, static_cast<int>(clip.radius_px * (1 << kShift)), cv::Scalar(40), cv::FILLED,
                 cv::LINE_AA, kShift);
    }
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        auto& value = image.at<std::uint8_t>(y, x);
        value = cv::saturate_cast<std::uint8_t>(value + 2.0 * random.normal());
      }
    }
    if (colour) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
    clip.images.push_back(image);
  }
  return clip;
}

StiffnessForceModel make_model(int grid, const TrackedBeads& rest) {
  StiffnessForceModel model;
  model.grid = grid;
  Eigen::Matrix3d h = Eigen::Vector3d(0.05, 0.05, 0.1).asDiagonal();
  h(2, 0) = h(2, 1) = 0.01;
  model.stiffness.assign(static_cast<std::size_t>((grid - 1) * (grid - 1)), h);
  model.rest = rest.positions;
  model.lowest_seen.assign(rest.positions.size(), Eigen::Vector3d::Constant(-5.0));
  model.highest_seen.assign(rest.positions.size(), Eigen::Vector3d::Constant(5.0));
  return model;
}

enum class Work { kTrack, kTrackAndForce, kTrackForceAndDisplay };

void track(benchmark::State& state, Work work, CentroidKind centroid) {
  const int grid = static_cast<int>(state.range(0));
  Clip clip = make_clip(grid, state.range(1) != 0);
  clip.settings.centroid = centroid;
  BeadTracker tracker(clip.settings);
  const StiffnessForceModel model = make_model(grid, tracker.track({clip.images[0], 0}));
  std::int64_t frame = 0;
  int lost = 0;
  cv::Mat picture;
  std::vector<double> microseconds;
  microseconds.reserve(1 << 20);
  for (auto _ : state) {
    ++frame;
    const Frame next{clip.images[static_cast<std::size_t>(frame % kFrames)], frame * kIntervalUs};
    const auto begin = std::chrono::steady_clock::now();
    const TrackedBeads& beads = tracker.track(next);
    lost += grid * grid - beads.found();
    if (work != Work::kTrack) {
      ForceEstimate force = estimate(model, beads);
      benchmark::DoNotOptimize(force);
      if (work == Work::kTrackForceAndDisplay) draw_overlay(next.image, beads, force, picture);
    }
    const std::chrono::duration<double, std::micro> taken = std::chrono::steady_clock::now() - begin;
    if (microseconds.size() < microseconds.capacity()) microseconds.push_back(taken.count());
  }
  if (lost > 0) state.SkipWithError("a bead was lost");
  std::sort(microseconds.begin(), microseconds.end());
  const auto part = [&](double fraction) {
    return microseconds[static_cast<std::size_t>(fraction * static_cast<double>(microseconds.size() - 1))];
  };
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(frame), benchmark::Counter::kIsRate);
  state.counters["p50_us"] = part(0.5);
  state.counters["p99_us"] = part(0.99);
  state.counters["max_us"] = part(1.0);
}

void simple_blob_detector(benchmark::State& state) {
  cv::setNumThreads(1);
  const int grid = static_cast<int>(state.range(0));
  const Clip clip = make_clip(grid, state.range(1) != 0);
  cv::SimpleBlobDetector::Params params;
  const auto area = static_cast<float>(3.14159265 * clip.radius_px * clip.radius_px);
  params.minArea = 0.5f * area;
  params.maxArea = 2.0f * area;
  const auto detector = cv::SimpleBlobDetector::create(params);
  std::vector<cv::KeyPoint> found;
  std::int64_t frame = 0;
  bool all = true;
  for (auto _ : state) {
    detector->detect(clip.images[static_cast<std::size_t>(++frame % kFrames)], found);
    all = all && static_cast<int>(found.size()) == grid * grid;
  }
  if (!all) state.SkipWithError("a blob was lost");
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(frame), benchmark::Counter::kIsRate);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"grid", "colour"})->Unit(benchmark::kMicrosecond);
  for (const int grid : {3, 10}) {
    for (const int colour : {0, 1}) benchmark->Args({grid, colour});
  }
}

BENCHMARK_CAPTURE(track, alone, Work::kTrack, CentroidKind::kBinary)->Apply(sizes);
BENCHMARK_CAPTURE(track, with_force, Work::kTrackAndForce, CentroidKind::kBinary)->Apply(sizes);
BENCHMARK_CAPTURE(track, with_display, Work::kTrackForceAndDisplay, CentroidKind::kBinary)->Apply(sizes);
BENCHMARK_CAPTURE(track, weighted_centroid, Work::kTrack, CentroidKind::kWeighted)->Apply(sizes);
BENCHMARK(simple_blob_detector)->Apply(sizes);

}  // namespace
}  // namespace touchstone::sensors

BENCHMARK_MAIN();
