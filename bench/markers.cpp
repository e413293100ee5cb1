// Frames a second of the gelsight marker tracker on one core at 320 x 240, alone and with all that finds slip, beside
// OpenCV's SimpleBlobDetector on the same frames; and at 640 x 480. The thesis [Li2015] gives 25 to 30 frames/s
// (Matlab, i7-3840QM).

#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

#include "sensors/markers/incipient_slip.h"
#include "sensors/markers/motion_ratio.h"
#include "tests/sensors/markers/painted_markers.h"

namespace touchstone::sensors {
namespace {

constexpr double kPublished_fps = 30.0;  // sec. 4.3: "about 25-30"
constexpr int kFrames = 16;

std::vector<cv::Mat> make_clip() {
  std::vector<cv::Mat> clip;
  for (int frame = 0; frame < kFrames; ++frame) {
    auto places = fixtures::marker_grid();
    const double phase = 2.0 * 3.14159265358979323846 * frame / kFrames;
    for (Eigen::Vector2d& place : places) place += 3.0 * Eigen::Vector2d(1.0 - std::cos(phase), std::sin(phase));
    clip.push_back(fixtures::paint_markers({.noise = 2.0}, places, static_cast<std::uint64_t>(1 + frame)));
  }
  return clip;
}

void report(benchmark::State& state, std::int64_t frames) {
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(frames), benchmark::Counter::kIsRate);
  state.counters["times_published"] =
      benchmark::Counter(static_cast<double>(frames) / kPublished_fps, benchmark::Counter::kIsRate);
}

void track_markers(benchmark::State& state) {
  const std::vector<cv::Mat> clip = make_clip();
  MarkerTracker tracker({});
  std::int64_t frame = 0;
  const std::size_t markers = tracker.track({clip[0], 0}).rest.size();
  bool all = true;
  for (auto _ : state) {
    ++frame;
    all = all &&
          tracker.track({clip[static_cast<std::size_t>(frame % kFrames)], frame}).found() == static_cast<int>(markers);
  }
  if (!all) state.SkipWithError("a marker was lost");
  report(state, frame);
}

/// 11 x 9 markers in 640 x 480, learnt from the frame at rest.
void track_large_frames(benchmark::State& state) {
  std::vector<cv::Mat> clip;
  for (int frame = 0; frame < kFrames; ++frame) {
    std::vector<Eigen::Vector2d> places;
    for (int marker = 0; marker < 99; ++marker) {
      places.emplace_back(90.3 + 46.0 * (marker % 11) + 2.0 * frame, 56.2 + 46.0 * (marker / 11) - 1.5 * frame);
    }
    clip.push_back(fixtures::paint_markers({.width = 640, .height = 480, .diameter_px = 12.0, .noise = 2.0}, places,
                                           static_cast<std::uint64_t>(1 + frame)));
  }
  MarkerTracker tracker({});
  std::int64_t frame = 0;
  bool all = tracker.track({clip[0], 0}).rest.size() == 99;
  for (auto _ : state) {
    ++frame;
    const auto phase = static_cast<std::size_t>(frame % (2 * kFrames - 2));  // there and back again
    all = all && tracker.track({clip[phase < kFrames ? phase : 2 * kFrames - 2 - phase], frame}).found() == 99;
  }
  if (!all) state.SkipWithError("a marker was lost");
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(frame), benchmark::Counter::kIsRate);
}

void track_and_find_slip(benchmark::State& state) {
  const std::vector<cv::Mat> clip = make_clip();
  MarkerTracker tracker({});
  IncipientSlipDetector detector;
  tracker.track({clip[0], 0});
  cv::Mat contact;
  std::int64_t frame = 0;
  for (auto _ : state) {
    ++frame;
    const cv::Mat& now = clip[static_cast<std::size_t>(frame % kFrames)];
    const TrackedMarkers& markers = tracker.track({now, frame});
    MotionRatio ratio =
        motion_ratio(clip[0], clip[static_cast<std::size_t>((frame + kFrames - 1) % kFrames)], now, {}, &contact);
    benchmark::DoNotOptimize(ratio);
    erase_markers(contact, markers, 4.0);
    contact(cv::Rect(100, 60, 120, 120)).setTo(255);
    IncipientSlip slip = detector.update(markers, contact_patch(contact, 50));
    benchmark::DoNotOptimize(slip);
  }
  report(state, frame);
}

void simple_blob_detector(benchmark::State& state) {
  cv::setNumThreads(1);
  const std::vector<cv::Mat> clip = make_clip();
  cv::SimpleBlobDetector::Params params;
  params.minArea = 20.0f;
  params.maxArea = 90.0f;
  const auto detector = cv::SimpleBlobDetector::create(params);
  std::vector<cv::KeyPoint> found;
  std::int64_t frame = 0;
  for (auto _ : state) {
    ++frame;
    detector->detect(clip[static_cast<std::size_t>(frame % kFrames)], found);
  }
  state.counters["found"] = static_cast<double>(found.size());
  report(state, frame);
}

BENCHMARK(track_markers)->Unit(benchmark::kMicrosecond);
BENCHMARK(track_large_frames)->Unit(benchmark::kMicrosecond);
BENCHMARK(track_and_find_slip)->Unit(benchmark::kMicrosecond);
BENCHMARK(simple_blob_detector)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace touchstone::sensors

BENCHMARK_MAIN();
