// Milliseconds a frame from a field of 10 x 10 markers to tractions, force and friction, on one core: by patches of 3,
// 2 and 1.5 mm (markers are 3 mm apart), with all markers, and with other markers missing in each frame.

#include <benchmark/benchmark.h>

#include <cmath>

#include "core/random.h"
#include "sensors/tractions/friction_state.h"
#include "tests/sensors/tractions/half_space_markers.h"

namespace touchstone::sensors {
namespace {

constexpr int kFrames = 16;

/// A contact of 6 mm radius that is dragged to the side.
std::vector<MarkerField> make_clip(const MarkerCompliance& map) {
  std::vector<MarkerField> clip;
  for (int frame = 0; frame < kFrames; ++frame) {
    Eigen::VectorXd tractions = Eigen::VectorXd::Zero(3 * map.patches());
    for (int p = 0; p < map.patches(); ++p) {
      const double r = map.patch_centre(p).norm() / 6.0;
      if (r >= 1.0) continue;
      const double pressure = 0.12 * std::sqrt(1.0 - r * r);
      tractions.segment<3>(3 * p) << 0.03 * frame * pressure, 0.0, -pressure;
    }
    const Eigen::VectorXd moved = map.displacement * tractions;
    RandomStream random(1, static_cast<std::uint64_t>(frame), Purpose::kTest);
    MarkerField field;
    field.grid = map.marker_grid;
    for (int m = 0; m < map.markers(); ++m) {
      field.displacement.emplace_back(moved.segment<3>(3 * m) + Eigen::Vector3d(0.02 * random.normal(),
                                                                                0.02 * random.normal(),
                                                                                0.06 * random.normal()));
    }
    field.measured.assign(field.displacement.size(), 1);
    clip.push_back(std::move(field));
  }
  return clip;
}

/// Arguments: patches a side; whether a marker is missing, another one in each frame.
void invert(benchmark::State& state) {
  const auto patches = static_cast<int>(state.range(0));
  const MarkerCompliance map = fixtures::half_space_markers(10, patches, 31.0 / patches);
  std::vector<MarkerField> clip = make_clip(map);
  if (state.range(1) != 0) {
    for (std::size_t k = 0; k < clip.size(); ++k) clip[k].measured[5 * k + 3] = 0;
  }
  TractionInversion inversion(map);
  FrictionObserver observer;
  inversion.invert(clip.back());
  std::size_t frame = 0;
  std::int64_t factorisations = 0;
  for (auto _ : state) {
    const MarkerField& field = clip[frame++ % kFrames];
    const TractionField tractions = inversion.invert(field);
    factorisations += tractions.factorisations;
    benchmark::DoNotOptimize(observer.update(field, tractions).ratio);
  }
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(frame), benchmark::Counter::kIsRate);
  state.counters["factorisations"] = static_cast<double>(factorisations) / static_cast<double>(frame);
}

BENCHMARK(invert)->ArgsProduct({{11, 16, 21}, {0, 1}})->ArgNames({"patches", "missing"})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchstone::sensors

BENCHMARK_MAIN();
