// Frames and events a second of the event pixels on the clip of lab/dvs/event_clip.h, of which a machine of the same
// kind made 226 and 97 frames/s by v2e [Hu2021], without noise and with it.
//   build/dev/bench/bench_events

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "lab/dvs/event_clip.h"
#include "render/events/event_pixels.h"

namespace touchstone::lab {
namespace {

void frames(benchmark::State& state, const render::EventPixelSettings& settings, bool compare) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(state.range(0)));
  static const std::vector<cv::Mat> images = event_clip();
  const auto period = static_cast<std::int64_t>(images.size());
  render::EventPixels pixels(settings, {kEventClipWidth, kEventClipHeight}, 1, 1);
  std::vector<Event> events;
  pixels.advance(images[0], 0, events);
  std::int64_t frame = 0;
  double count = 0.0;
  for (auto _ : state) {
    ++frame;
    events.clear();
    pixels.advance(images[static_cast<std::size_t>(frame % period)], frame * kEventClipInterval_us, events);
    benchmark::DoNotOptimize(events.data());
    count += static_cast<double>(events.size());
  }
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(frame), benchmark::Counter::kIsRate);
  state.counters["events/s"] = benchmark::Counter(count, benchmark::Counter::kIsRate);
  state.counters["events/frame"] = count / static_cast<double>(frame);
  if (compare) state.counters["off_by"] = count / event_clip_count(frame, settings.on_threshold) - 1.0;
}

void without_noise(benchmark::State& state) {
  frames(state, event_clip_ideal(), true);
}
void with_noise(benchmark::State& state) {
  frames(state, event_clip_noisy(), false);
}

BENCHMARK(without_noise)->ArgName("threads")->Arg(1)->Arg(4)->UseRealTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(with_noise)->ArgName("threads")->Arg(1)->Arg(4)->UseRealTime()->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace touchstone::lab

BENCHMARK_MAIN();
