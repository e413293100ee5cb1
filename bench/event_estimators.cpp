// Estimators of force and material from event counts [Naeini2020] on one core: a window's estimate, which the paper's
// windows give 7 ms for, and steps of training on 42 grasps of 44 windows.

#include <benchmark/benchmark.h>

#include <cmath>

#include "core/random.h"
#include "sensors/events/material_classifier.h"
#include "sensors/events/time_delay_network.h"
#include "sensors/learning/gaussian_process_tuning.h"
#include "sensors/learning/levenberg_marquardt.h"
#include "sensors/numerics/wide_cholesky.h"

namespace touchstone::sensors {
namespace {

constexpr Eigen::Index kSamples = 42 * 44;

/// A smooth function of inputs in [-1, 1], with noise: a target a sample.
NetworkSamples smooth_samples(Eigen::Index inputs, Eigen::Index count) {
  RandomStream random(1, static_cast<std::uint64_t>(inputs), Purpose::kTest);
  NetworkSamples samples{Eigen::MatrixXd(inputs, count), Eigen::MatrixXd(1, count)};
  for (Eigen::Index j = 0; j < count; ++j) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < inputs; ++i) {
      samples.inputs(i, j) = 2.0 * random.uniform() - 1.0;
      sum += samples.inputs(i, j) * static_cast<double>(i + 1);
    }
    samples.targets(0, j) = std::sin(sum) + 0.05 * random.normal();
  }
  return samples;
}

FeedForwardNetwork network(int inputs, int layers, int units, int outputs) {
  RandomStream random(1, 0, Purpose::kTest);
  return random_network({.inputs = inputs, .hidden_layers = layers, .units = units, .outputs = outputs}, random);
}

/// Estimate of a window by the paper's network, or another.
void time_delay_window(benchmark::State& state) {
  TimeDelayNetwork model;
  model.features = {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(1e4, 1e4)};
  model.force_N = {Eigen::VectorXd::Constant(1, 0.0), Eigen::VectorXd::Constant(1, 3.7)};
  model.network = network(6, static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), 1);
  TimeDelayEstimator estimator(model);
  const double window[] = {1234.0, 5678.0};
  for (auto _ : state) benchmark::DoNotOptimize(estimator.next(window));
}

void material_of_a_grasp(benchmark::State& state) {
  MaterialClassifier model;
  model.materials = {"foam", "rubber", "silicone", "steel"};
  model.features = {Eigen::VectorXd::Zero(88), Eigen::VectorXd::Constant(88, 1e4)};
  model.network = network(88, 2, 30, 4);
  const Eigen::VectorXd features = Eigen::VectorXd::LinSpaced(88, 0.0, 9e3);
  for (auto _ : state) benchmark::DoNotOptimize(classify(model, features).label);
}

GaussianProcess process_of(Eigen::Index samples) {
  const NetworkSamples data = smooth_samples(3, samples);
  return condition({Eigen::Vector3d(0.5, 0.5, 0.5), 1.0, 0.1}, data.inputs.transpose(), data.targets.transpose());
}

void gaussian_process_window(benchmark::State& state) {
  const GaussianProcess process = process_of(state.range(0));
  const Eigen::RowVector3d place(0.1, 0.2, 0.3);
  for (auto _ : state) benchmark::DoNotOptimize(predict(process, place)[0]);
}

void gaussian_process_window_with_variance(benchmark::State& state) {
  const GaussianProcess process = process_of(state.range(0));
  const Eigen::RowVector3d place(0.1, 0.2, 0.3);
  for (auto _ : state) benchmark::DoNotOptimize(predict_with_variance(process, place).variance[0]);
}

void gaussian_process_conditioned(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(process_of(state.range(0)).log_evidence);
}

/// Ten evaluations and the process itself: one fold.
void gaussian_process_tuned(benchmark::State& state) {
  const NetworkSamples data = smooth_samples(3, kSamples);
  TuningSettings settings;
  settings.aim = TuningAim::kEvidence;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        tune_gaussian_process(data.inputs.transpose(), data.targets.transpose(), {}, {}, settings).process.mean);
  }
}

/// One step of eq. 3: the matrix, its factor, the step. Third argument: the form.
void levenberg_marquardt_step(benchmark::State& state) {
  const NetworkSamples data = smooth_samples(6, kSamples);
  const FeedForwardNetwork net = network(6, static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), 1);
  const auto form = static_cast<StepForm>(state.range(2));
  for (auto _ : state) {
    const LevenbergMarquardtSystem system(net, data, form);
    benchmark::DoNotOptimize(system.step(0.01)->data());
  }
}

void cholesky(benchmark::State& state) {
  const Eigen::Index size = state.range(0);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Constant(size, size, 0.5);
  matrix.diagonal().setConstant(2.0);
  for (auto _ : state) {
    Eigen::MatrixXd factor = matrix;
    benchmark::DoNotOptimize(factorise_in_place(factor));
  }
  const auto n = static_cast<double>(size);
  state.counters["flops"] =
      benchmark::Counter(n * n * n / 3.0 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

BENCHMARK(time_delay_window)->Args({4, 40})->Args({5, 40})->Args({1, 10})->Unit(benchmark::kMicrosecond);
BENCHMARK(material_of_a_grasp)->Unit(benchmark::kMicrosecond);
BENCHMARK(gaussian_process_window)->Arg(kSamples)->Arg(7000)->Unit(benchmark::kMicrosecond);
BENCHMARK(gaussian_process_window_with_variance)->Arg(kSamples)->Arg(7000)->Unit(benchmark::kMicrosecond);
BENCHMARK(gaussian_process_conditioned)->Arg(kSamples)->Arg(7000)->Unit(benchmark::kMillisecond);
BENCHMARK(gaussian_process_tuned)->Unit(benchmark::kMillisecond);
BENCHMARK(levenberg_marquardt_step)
    ->Args({4, 40, static_cast<int>(StepForm::kDual)})
    ->Args({4, 40, static_cast<int>(StepForm::kNormal)})
    ->Args({2, 20, static_cast<int>(StepForm::kCheaper)})
    ->Args({1, 10, static_cast<int>(StepForm::kCheaper)})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(cholesky)->Arg(kSamples)->Arg(4000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchstone::sensors

BENCHMARK_MAIN();
