// Estimators of the fingertip of 18x18 pixels [Knoop2013] on one core: a reflex's decision, which the chip gives 667 us
// for, and a picture of explore mode, which comes each 216 ms.

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "core/random.h"
#include "sensors/reflex/explore_tracker.h"
#include "sensors/reflex/reflex_loop.h"

namespace touchstone::sensors {
namespace {

/// The paper's tree, a force of degree 1 or 2, and a law of shear.
ReflexModel reflex_model(int degree) {
  ReflexModel model;
  model.tree.nodes.resize(7);
  model.tree.nodes[0] = {ChipFeature::maximum, 40.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.tree.nodes[2] = {ChipFeature::maximum, 38.0, 3, 4, false};
  model.tree.nodes[3] = {ChipFeature::squal, 81.0, 5, 6, false};
  model.tree.nodes[6].force_present = true;
  model.force.degree = degree;
  model.force.coefficients[1] = 0.1;
  if (degree == 2) model.force.coefficients[5] = 0.001;
  model.shear = ShearLaw{Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Identity(), 0.0};
  return model;
}

void reflex_decision(benchmark::State& state) {
  ReflexLoop loop(reflex_model(static_cast<int>(state.range(0))), {.stop_above_N = 2.0});
  RandomStream random(1, 0, Purpose::kTest);
  std::vector<ChipStatistics> frames(1024);
  for (ChipStatistics& one : frames) {
    one.maximum = 30 + static_cast<int>(30.0 * random.uniform());
    one.minimum = 4;
    one.squal = static_cast<int>(150.0 * random.uniform());
    one.average = 15.0;
    one.dx = static_cast<int>(3.0 * random.uniform());
  }
  std::size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(loop.next(frames[next++ & 1023]));
}

/// A picture of bright spots where the dots are after a motion.
cv::Mat picture(const DotsMotion& motion, std::uint64_t index) {
  RandomStream places(1, 0, Purpose::kTest), noise(1, index, Purpose::kTest);
  cv::Mat light(18, 18, CV_64F, cv::Scalar(8.0));
  for (int i = 0; i < 121; ++i) {
    const Eigen::Vector2d rest(3.1 * (i % 11 - 5) + places.uniform(), 3.1 * (i / 11 - 5) + places.uniform());
    const Eigen::Vector2d at = motion(rest);
    for (int row = 0; row < 18; ++row) {
      for (int column = 0; column < 18; ++column) {
        const double square = (at - Eigen::Vector2d(column - 8.5, row - 8.5)).squaredNorm();
        light.at<double>(row, column) += 26.0 * std::exp(-square / (0.8 * motion.dilation * motion.dilation));
      }
    }
  }
  cv::Mat result(18, 18, CV_8UC1);
  for (int i = 0; i < 324; ++i) {
    result.data[i] =
        static_cast<unsigned char>(std::clamp(std::round(light.ptr<double>()[i] + 0.5 * noise.normal()), 0.0, 63.0));
  }
  return result;
}

void explore_picture(benchmark::State& state) {
  ExploreSettings settings;
  if (state.range(0) == 1) settings = text_explore_settings();
  if (state.range(0) == 2) settings.times = chip_pixel_times();
  if (state.range(0) == 3) settings.absolute_from = 1.0;  // steps are measured as well
  std::vector<Frame> frames;
  for (int i = 0; i < 50; ++i) {
    const double press_mm = 0.2 * std::min(i, 50 - i);
    frames.push_back(
        {picture({16.0 / (16.0 - press_mm), {0.1 * press_mm, 0.0}}, static_cast<std::uint64_t>(2 + i)), 0});
  }
  ExploreTracker tracker(picture({}, 1), settings);
  std::int64_t t_us = 0;
  for (auto _ : state) {
    Frame& frame = frames[static_cast<std::size_t>(t_us / 216000 % 50)];
    frame.t_us = t_us += 216000;
    benchmark::DoNotOptimize(tracker.next(frame).motion.dilation);
  }
}

BENCHMARK(reflex_decision)->Arg(1)->Arg(2)->Unit(benchmark::kNanosecond);
BENCHMARK(explore_picture)->DenseRange(0, 3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchstone::sensors

BENCHMARK_MAIN();
