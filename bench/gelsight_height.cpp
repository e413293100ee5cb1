// From a 320 x 240 frame of a coated gel to its height map on one core, whole and in parts; beside it the Poisson step
// of SciPy (two-dimensional sine transforms, as the thesis has it), which runs as a process of its own on the same
// slopes. The published rate is 20 frames/s [Li2015, sec. 2.2.3].

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_estimator.h"
#include "tests/sensors/heights/painted_gel.h"

namespace touchstone::sensors {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kScale = 0.053;
constexpr double kPublished_Hz = 20.0;

struct Scene {
  HeightModel model;
  cv::Mat frame;
};

const Scene& scene() {
  static const Scene one = [] {
    fixtures::GelPainter painter(kWidth, kHeight, kScale, {.fall_off = 0.2});
    HeightCalibrationSettings settings;
    settings.mm_per_px = kScale;
    settings.correction = LightCorrection::fitted;
    Scene made;
    made.model = calibrate_height(painter.presses(3, 3, 1.0, 0.75), painter.background(), settings).model;
    made.frame = painter.press({{8.0, 6.5}, 4.0, 2.0}).frame;
    return made;
  }();
  return one;
}

void frame_to_height(benchmark::State& state) {
  cv::setNumThreads(1);
  HeightEstimator estimator(scene().model, {.border = state.range(0) != 0 ? HeightBorder::free : HeightBorder::zero});
  for (auto _ : state) benchmark::DoNotOptimize(estimator.estimate(scene().frame).contact_pixels);
  const auto frames = static_cast<double>(state.iterations());
  state.counters["frames/s"] = benchmark::Counter(frames, benchmark::Counter::kIsRate);
  state.counters["of_20_Hz"] = benchmark::Counter(frames / kPublished_Hz, benchmark::Counter::kIsRate);
}

struct Slopes {
  cv::Mat u, v;
};

const Slopes& slopes() {
  static const Slopes one = [] {
    HeightEstimator estimator(scene().model);
    const HeightResult& result = estimator.estimate(scene().frame);
    return Slopes{result.slope_u.clone(), result.slope_v.clone()};
  }();
  return one;
}

void poisson(benchmark::State& state) {
  PoissonSolver solver(kWidth, kHeight, state.range(0) != 0 ? HeightBorder::free : HeightBorder::zero);
  cv::Mat heights;
  for (auto _ : state) solver.integrate(slopes().u, slopes().v, kScale, heights);
}

/// One transform of the rows of the picture by OpenCV; a Poisson solver of it would take four.
void opencv_row_transform(benchmark::State& state) {
  cv::setNumThreads(1);
  cv::Mat terms;
  for (auto _ : state) cv::dct(slopes().u, terms, cv::DCT_ROWS);
}

/// SciPy's own time of one solution: the least of many, measured inside of its process.
void scipy_poisson(benchmark::State& state) {
  std::string name = (std::filesystem::temp_directory_path() / "touchstone-slopes-XXXXXX").string();
  const int file = mkstemp(name.data());
  if (file < 0) {
    state.SkipWithError("no temporary file can be made");
    return;
  }
  std::FILE* const out = fdopen(file, "wb");
  for (const cv::Mat& slope : {slopes().u, slopes().v}) {
    std::fwrite(slope.ptr<float>(), sizeof(float), slope.total(), out);
  }
  std::fclose(out);
  // Debian's Python: another one may stand before it on PATH.
  const std::string command = std::string("OMP_NUM_THREADS=1 /usr/bin/python3 ") + TOUCHSTONE_SOURCE_DIR +
                              "/bench/scipy_poisson.py " + name + " 2>/dev/null";
  double seconds = 0.0;
  if (std::FILE* const pipe = popen(command.c_str(), "r")) {
    if (std::fscanf(pipe, "%lf", &seconds) != 1) seconds = 0.0;
    pclose(pipe);
  }
  std::filesystem::remove(name);
  if (!(seconds > 0.0)) {
    state.SkipWithError("SciPy doesn't run; script/bootstrap --bench installs Debian's python3-scipy");
    return;
  }
  for (auto _ : state) state.SetIterationTime(seconds);
}

BENCHMARK(frame_to_height)->ArgName("free")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
BENCHMARK(poisson)->ArgName("free")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencv_row_transform)->Unit(benchmark::kMicrosecond);
BENCHMARK(scipy_poisson)->UseManualTime()->Iterations(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace touchstone::sensors

BENCHMARK_MAIN();
