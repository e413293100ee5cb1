#include "lab/dvs/dvs_force_experiment.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/seconds_since.h"
#include "sensors/events/force_score.h"
#include "sensors/learning/leave_one_out.h"

namespace touchstone::lab {
namespace {

/// What a trained model makes of a grasp: a force a window.
using Estimator = std::function<Eigen::VectorXd(const Eigen::MatrixXd& features)>;

struct Trained {
  Estimator estimate;
  int steps = 0;
};

using Trainer = std::function<Trained(std::span<const sensors::ForceSeries> series, const sensors::Fold& fold)>;

/// A model's squared error on one grasp's judged windows.
double error_on(const Estimator& estimate, const sensors::ForceSeries& series) {
  const Eigen::VectorXd judged = estimate(series.features)(series.judged);
  return sensors::mean_squared_error(judged, series.force_N(series.judged));
}

/// Least change within the grasping and within the releasing phase: the judged windows that meet where the hold was
/// left out don't follow each other.
std::optional<double> least_change_of(const Eigen::VectorXd& estimate, const Eigen::VectorXd& level,
                                      Eigen::Index grasp_windows) {
  const Eigen::Index rest = estimate.size() - grasp_windows;
  const auto grasping = sensors::least_force_change(estimate.head(grasp_windows), level.head(grasp_windows));
  const auto releasing = sensors::least_force_change(estimate.tail(rest), level.tail(rest));
  if (!grasping) return releasing;
  return releasing ? std::min(*grasping, *releasing) : *grasping;
}

DvsForceScore test_forces(std::span<const DvsSequence> sequences, const DvsForceSettings& settings, DvsInputs inputs,
                          const Trainer& train, const Progress& progress) {
  if (settings.every < 1) fail("dvs force: every {} folds; it must be at least 1", settings.every);
  const std::vector<sensors::ForceSeries> series = force_series_of(sequences, settings.learned, inputs);
  std::vector<double> peaks;
  for (const DvsSequence& sequence : sequences) peaks.push_back(sequence.measured_N.maxCoeff());
  const std::vector<sensors::Fold> folds = sensors::folds_by_level(peaks, settings.validation, settings.seed);

  DvsForceScore score;
  score.folds.resize((folds.size() + static_cast<std::size_t>(settings.every) - 1) /
                     static_cast<std::size_t>(settings.every));
  const auto work = [&](int at) {
    const sensors::Fold& fold = folds[static_cast<std::size_t>(at * settings.every)];
    const DvsSequence& tested = sequences[static_cast<std::size_t>(fold.test)];
    const sensors::ForceSeries& test = series[static_cast<std::size_t>(fold.test)];
    DvsForceFold result;
    result.grasp = fold.test;
    double begun = thread_seconds();
    const Trained model = train(series, fold);
    result.training_s = thread_seconds() - begun;
    result.steps = model.steps;
    for (const int grasp : fold.validation) {
      result.validation_mse += error_on(model.estimate, series[static_cast<std::size_t>(grasp)]) /
                               static_cast<double>(fold.validation.size());
    }
    begun = thread_seconds();
    const Eigen::VectorXd all = model.estimate(test.features);
    result.window_us = 1e6 * (thread_seconds() - begun) / static_cast<double>(all.size());
    const Eigen::VectorXd estimate = all(test.judged);
    const Eigen::VectorXd learned = test.force_N(test.judged);
    const Eigen::VectorXd truth = tested.true_N(test.judged);
    const Eigen::VectorXd measured = tested.measured_N(test.judged);
    const Eigen::Index grasping = tested.windows.grasp_windows;
    result.test_mse = sensors::mean_squared_error(estimate, learned);
    result.true_mse = sensors::mean_squared_error(estimate, truth);
    result.true_grasping_mse = sensors::mean_squared_error(estimate.head(grasping), truth.head(grasping));
    result.sensor_mse = sensors::mean_squared_error(measured, truth);
    result.least_change = least_change_of(estimate, learned, grasping);
    score.folds[static_cast<std::size_t>(at)] = result;
  };
  sensors::run_folds(static_cast<int>(score.folds.size()), settings.threads, work, progress);
  return score;
}

}  // namespace

double DvsForceScore::mean(double DvsForceFold::*figure) const {
  TS_ASSERT(!folds.empty());
  double sum = 0.0;
  for (const DvsForceFold& fold : folds) sum += fold.*figure;
  return sum / static_cast<double>(folds.size());
}

double DvsForceScore::standard_error(double DvsForceFold::*figure) const {
  if (folds.size() < 2) return 0.0;
  const double middle = mean(figure);
  double squares = 0.0;
  for (const DvsForceFold& fold : folds) squares += std::pow(fold.*figure - middle, 2);
  const auto count = static_cast<double>(folds.size());
  return std::sqrt(squares / (count - 1.0) / count);
}

double DvsForceScore::sensitivity_N() const {
  std::vector<std::optional<double>> changes;
  for (const DvsForceFold& fold : folds) changes.push_back(fold.least_change);
  return sensors::sensitivity(changes);
}

DvsForceScore test_force_networks(std::span<const DvsSequence> sequences,
                                  const sensors::TimeDelayNetworkSettings& network, const DvsForceSettings& settings,
                                  const Progress& progress) {
  const Trainer train = [&](std::span<const sensors::ForceSeries> series, const sensors::Fold& fold) -> Trained {
    sensors::TrainedTimeDelayNetwork trained =
        sensors::train_time_delay_network(series, fold.training, fold.validation, network, fold.test);
    const int steps = trained.report.steps;
    return {[model = std::move(trained.model)](const Eigen::MatrixXd& features) {
              return sensors::estimate_force(model, features);
            },
            steps};
  };
  return test_forces(sequences, settings, DvsInputs::counts, train, progress);
}

DvsForceScore test_force_processes(std::span<const DvsSequence> sequences, const sensors::TuningSettings& tuning,
                                   const DvsForceSettings& settings, const Progress& progress, DvsInputs inputs) {
  const Trainer train = [&](std::span<const sensors::ForceSeries> series, const sensors::Fold& fold) -> Trained {
    const sensors::StackedSeries training = sensors::stack(series, fold.training);
    const sensors::StackedSeries validation = sensors::stack(series, fold.validation);
    sensors::TunedGaussianProcess tuned = sensors::tune_gaussian_process(
        training.features, training.force_N, validation.features, validation.force_N, tuning, fold.test);
    const int steps = tuned.factorisations;
    return {[process = std::move(tuned.process)](const Eigen::MatrixXd& features) {
              return sensors::predict(process, features);
            },
            steps};
  };
  return test_forces(sequences, settings, inputs, train, progress);
}

}  // namespace touchstone::lab
