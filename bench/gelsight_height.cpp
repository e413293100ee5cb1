#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "sensors/poisson_solver.h"

namespace touchstone::sensors {
namespace {
void poisson(benchmark::State& state) {
  const auto border = state.range(0) != 0 ? HeightBorder::free : HeightBorder::zero;
  cv::Mat u(240, 320, CV_32FC1);
  cv::Mat v(240, 320, CV_32FC1);
  cv::setRNGSeed(1);
  cv::randn(u, 0.0, 0.1);
  cv::randn(v, 0.0, 0.1);
  PoissonSolver solver(320, 240, border);
  cv::Mat heights;
  for (auto _ : state) solver.integrate(u, v, 0.05, heights);
}
BENCHMARK(poisson)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
void opencv_dct(benchmark::State& state) {
  cv::setNumThreads(1);
  cv::Mat u(240, 320, CV_32FC1), w;
  cv::randn(u, 0.0, 0.1);
  for (auto _ : state) cv::dct(u, w, cv::DCT_ROWS);
}
BENCHMARK(opencv_dct)->Unit(benchmark::kMicrosecond);
}  // namespace
}  // namespace touchstone::sensors
BENCHMARK_MAIN();
