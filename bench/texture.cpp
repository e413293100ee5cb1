// Texture recognition on one core: features of 200 x 200 height images, and the nearest of 960 of them. The thesis
// [Li2015] gives no figure for its own speed; a camera gives 30 frames a second.

#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "core/random.h"
#include "sensors/texture/height_gray.h"
#include "sensors/texture/texture_model.h"

namespace touchstone::sensors {
namespace {

constexpr TextureOperator kOperators[] = {{{16, 2.0}, 4}, {{8, 1.0}, 4}, {{24, 3.0}, 4}};

cv::Mat rough_heights(std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  cv::Mat heights(200, 200, CV_32FC1);
  for (int j = 0; j < heights.rows; ++j) {
    for (int i = 0; i < heights.cols; ++i) heights.at<float>(j, i) = static_cast<float>(0.03 * random.normal());
  }
  return heights;
}

void gray_of_heights(benchmark::State& state) {
  const cv::Mat heights = rough_heights(1);
  for (auto _ : state) benchmark::DoNotOptimize(height_gray(heights, 0.002).data);
  state.SetItemsProcessed(state.iterations());
}

void feature(benchmark::State& state) {
  const TextureOperator& op = kOperators[state.range(0)];
  const cv::Mat gray = height_gray(rough_heights(1), 0.002);
  for (auto _ : state) benchmark::DoNotOptimize(texture_feature(gray, op).data());
  state.SetItemsProcessed(state.iterations());
}

void nearest_of_960(benchmark::State& state) {
  TextureModel model;
  model.classes = {"a", "b"};
  const Eigen::VectorXf one = texture_feature(height_gray(rough_heights(1), 0.002), model.op);
  model.features.resize(960, one.size());
  for (int i = 0; i < 960; ++i) {
    model.labels.push_back(i % 2);
    model.features.row(i) = (one + 0.01F * Eigen::VectorXf::Random(one.size())).cwiseAbs().normalized().transpose();
  }
  for (auto _ : state) benchmark::DoNotOptimize(classify(model, one).label);
  state.SetItemsProcessed(state.iterations());
}

BENCHMARK(gray_of_heights)->Unit(benchmark::kMicrosecond);
BENCHMARK(feature)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);
BENCHMARK(nearest_of_960)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace touchstone::sensors

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
