#include "sensors/events/grasp_training.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "sensors/events/material_trial.h"
#include "sensors/learning/gaussian_process_tuning.h"
#include "sensors/learning/leave_one_out.h"

namespace touchstone::sensors {
namespace {

constexpr std::size_t kFewestGrasps = 3;
/// By the evidence, since what a process says of its own error is wanted; on so many samples at most, for the time.
const TuningSettings kTuning = {.method = TuningMethod::kGradient, .aim = TuningAim::kEvidence, .most_samples = 500};

using Estimator = decltype(GraspForceModel::estimator);

Estimator train(std::span<const ForceSeries> series, const std::vector<int>& training,
                const std::vector<int>& validation, const GraspForceTraining& how, int fold) {
  if (how.method == GraspForceMethod::network) {
    return train_time_delay_network(series, training, validation, how.network, fold).model;
  }
  std::vector<int> all = training;  // a process is tuned by its evidence and needs no grasps apart
  all.insert(all.end(), validation.begin(), validation.end());
  std::ranges::sort(all);
  const StackedSeries stacked = stack(series, all);
  return tune_gaussian_process(stacked.features, stacked.force_N, {}, {}, kTuning, fold).process;
}

/// What a model says of each judged window of a grasp, and what it is off by.
struct TestedGrasp {
  std::vector<double> force_N, off_N, variance;
};

TestedGrasp test(const Estimator& estimator, const ForceSeries& series) {
  TestedGrasp tested;
  const auto note = [&](double estimate_N, int row, double variance) {
    tested.force_N.push_back(estimate_N);
    tested.off_N.push_back(estimate_N - series.force_N[row]);
    tested.variance.push_back(variance);
  };
  if (const auto* network = std::get_if<TimeDelayNetwork>(&estimator)) {
    const Eigen::VectorXd estimate = estimate_force(*network, series.features);
    for (const int row : series.judged) note(estimate[row], row, 0.0);
    return tested;
  }
  const Eigen::MatrixXd judged = series.features(series.judged, Eigen::all);
  const GaussianProcessPrediction predicted = predict_with_variance(std::get<GaussianProcess>(estimator), judged);
  for (std::size_t i = 0; i < series.judged.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    note(predicted.mean[at], series.judged[i], predicted.variance[at]);
  }
  return tested;
}

/// Puts the errors on grasps left out into a model, and tells how many of them are within two of those stated then.
double state_errors(const std::vector<TestedGrasp>& tested, GraspForceModel& model) {
  TestedGrasp all;
  for (const TestedGrasp& grasp : tested) {
    all.force_N.insert(all.force_N.end(), grasp.force_N.begin(), grasp.force_N.end());
    all.off_N.insert(all.off_N.end(), grasp.off_N.begin(), grasp.off_N.end());
    all.variance.insert(all.variance.end(), grasp.variance.begin(), grasp.variance.end());
  }
  model.error = fit_force_error(all.off_N, all.force_N);
  double within = 0.0;
  for (std::size_t i = 0; i < all.off_N.size(); ++i) {
    within += std::abs(all.off_N[i]) <= 2.0 * *model.sigma_N(all.force_N[i], all.variance[i]) ? 1.0 : 0.0;
  }
  return within / static_cast<double>(all.off_N.size());
}

}  // namespace

GraspForceCalibration calibrate_grasp_force(std::span<const KnownGrasp> grasps, const GraspForceTraining& training,
                                            const Progress& progress) {
  if (grasps.size() < kFewestGrasps) {
    fail("grasp force: {} grasps can be used; at least {} are needed", grasps.size(), kFewestGrasps);
  }
  std::vector<ForceSeries> series;
  std::vector<double> peaks;
  for (const KnownGrasp& grasp : grasps) {
    TS_ASSERT(grasp.force_N.size() > 0);
    series.push_back(force_series_of(grasp, training.method == GraspForceMethod::process));
    peaks.push_back(grasp.force_N.maxCoeff());
  }
  const auto count = static_cast<int>(grasps.size());
  const int validation = std::min(training.validation, count / 3);
  const std::vector<Fold> folds = folds_by_level(peaks, validation, training.seed);
  const int left_out = std::clamp(training.left_out, 0, count);
  // The first trains the model that is delivered, on all grasps; the others are spread over the table.
  std::vector<TestedGrasp> tested(static_cast<std::size_t>(left_out));
  GraspForceCalibration made;
  const auto work = [&](int at) {
    if (at == 0) {
      std::vector<int> all = folds.front().training;
      all.push_back(folds.front().test);
      std::ranges::sort(all);
      made.model.estimator = train(series, all, folds.front().validation, training, 0);
      return;
    }
    const Fold& fold = folds[static_cast<std::size_t>((at - 1) * count / left_out)];
    tested[static_cast<std::size_t>(at - 1)] =
        test(train(series, fold.training, fold.validation, training, fold.test + 1),
             series[static_cast<std::size_t>(fold.test)]);
  };
  run_folds(left_out + 1, training.threads, work, progress);
  for (const ForceSeries& one : series) made.windows += std::ssize(one.judged);
  made.left_out = left_out;
  if (left_out > 0) made.within_two = state_errors(tested, made.model);
  return made;
}

GraspMaterialCalibration calibrate_grasp_material(std::span<const KnownGrasp> grasps,
                                                  const MaterialClassifierSettings& settings, int threads,
                                                  const Progress& progress) {
  std::vector<std::string> materials;
  std::vector<MaterialSample> samples;
  for (const KnownGrasp& grasp : grasps) samples.push_back(material_sample_of(grasp, materials));
  if (materials.size() < 2) {
    fail("grasp material: all grasps are of '{}'; at least two materials are needed",
         materials.empty() ? "none" : materials.front());
  }
  const MaterialTrialScore score =
      test_material_classifiers(samples, materials, {.classifier = settings, .threads = threads}, progress);
  std::vector<int> labels;
  for (const MaterialSample& sample : samples) labels.push_back(sample.label);
  const Fold fold = folds_by_class(labels, settings.seed).front();
  std::vector<int> training = fold.training;
  training.push_back(fold.test);
  std::ranges::sort(training);
  return {train_material_classifier(samples, materials, training, fold.validation, settings).model, score.test};
}

}  // namespace touchstone::sensors
