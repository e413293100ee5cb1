// Mechanics of the vhs gel: set-up from nothing, loading it from the cache, and presses, with and without friction.
//   build/dev/bench/bench_press
#include <benchmark/benchmark.h>

#include "fem/contact/press.h"
#include "sim/press/gel_setup.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace touchstone;

const sim::DeviceSpec& device() {
  static const sim::DeviceSpec spec = sim::read_device(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/devices/vhs.yaml");
  return spec;
}

std::shared_ptr<const fem::Compliance> gel() {
  static const auto compliance = sim::set_up_gel(device(), sim::default_cache_folder());
  return compliance;
}

void SetUp(benchmark::State& state) {
  const test::TemporaryFolder scratch;
  const auto folder = scratch.path() / "cache";
  for (auto _ : state) {
    std::filesystem::remove_all(folder);
    benchmark::DoNotOptimize(sim::set_up_gel(device(), folder));
  }
}
BENCHMARK(SetUp)->Unit(benchmark::kMillisecond)->Iterations(1);

void LoadFromCache(benchmark::State& state) {
  gel();
  for (auto _ : state) benchmark::DoNotOptimize(sim::set_up_gel(device(), sim::default_cache_folder()));
}
BENCHMARK(LoadFromCache)->Unit(benchmark::kMillisecond);

fem::PressTarget at(double x, double y, double z) {
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(x), fem::AxisControl::at(y), fem::AxisControl::at(z)};
  return target;
}

void FrictionlessPress(benchmark::State& state) {
  fem::Press press(*gel(), fem::RoundedCylinder{3.0, 0.3, 6.0}, 0.0);
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(press.step(at(0, 0, i++ % 2 ? -0.3 : -0.5)));
  state.counters["contact vertices"] = press.state().contact_vertices;
}
BENCHMARK(FrictionlessPress)->Unit(benchmark::kMillisecond);

void FrictionalStep(benchmark::State& state) {
  fem::Press press(*gel(), fem::RoundedCylinder{3.0, 0.3, 6.0}, 0.8);
  press.step(at(0, 0, -0.5));
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(press.step(at(i++ % 2 ? 0.05 : 0.1, 0, -0.5)));
}
BENCHMARK(FrictionalStep)->Unit(benchmark::kMillisecond);

void ForceControlledStep(benchmark::State& state) {
  fem::Press press(*gel(), fem::RoundedCylinder{3.0, 0.3, 6.0}, 0.8);
  fem::PressTarget target = at(0, 0, 0.3);
  target.axis[2] = fem::AxisControl::with_force(3.5);
  press.step(target);
  int i = 0;
  for (auto _ : state) {
    target.axis[0] = fem::AxisControl::with_force(i++ % 2 ? 0.3 : 0.6);
    benchmark::DoNotOptimize(press.step(target));
  }
}
BENCHMARK(ForceControlledStep)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
