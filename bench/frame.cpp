// Pictures of the vhs sensor: a whole frame, and one of which only what moved is traced.
//   build/dev/bench/bench_frame
#include <benchmark/benchmark.h>

#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"

namespace {

using namespace touchstone;

struct Setting {
  sim::SceneSpec scene;
  sim::Plan plan;
  std::shared_ptr<const fem::Compliance> gel;
  std::vector<sim::Truth> truths;
  std::unique_ptr<sim::VirtualCamera> camera;
};

const Setting& setting() {
  static const Setting one = [] {
    Setting s;
    s.scene = sim::read_scene(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/vhs/verification.yaml");
    s.scene.motion.keys.resize(1);
    s.plan = sim::make_plan(s.scene);
    s.gel = sim::set_up_gel(s.scene.device, sim::default_cache_folder());
    s.truths = sim::play_motion(s.scene, s.plan, *s.gel);
    s.camera = std::make_unique<sim::VirtualCamera>(s.scene, s.plan, *s.gel, s.truths.front());
    return s;
  }();
  return one;
}

void count(benchmark::State& state, const sim::Capture& capture) {
  state.counters["Mpaths"] = static_cast<double>(capture.paths_traced) / 1e6;
  state.counters["pixels"] = static_cast<double>(capture.pixels_traced);
  state.counters["paths/s"] =
      benchmark::Counter(static_cast<double>(capture.paths_traced), benchmark::Counter::kIsIterationInvariantRate);
}

void WholeFrame(benchmark::State& state) {
  sim::Capture capture;
  for (auto _ : state) capture = setting().camera->capture_whole(setting().truths.back());
  count(state, capture);
}
BENCHMARK(WholeFrame)->Unit(benchmark::kMillisecond)->UseRealTime();

void FrameOfWhatMoved(benchmark::State& state) {
  sim::Capture capture;
  for (auto _ : state) capture = setting().camera->capture(setting().truths.back());
  count(state, capture);
}
BENCHMARK(FrameOfWhatMoved)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
