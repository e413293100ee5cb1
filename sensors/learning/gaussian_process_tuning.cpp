#include "sensors/learning/gaussian_process_tuning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "sensors/learning/bayesian_minimum.h"
#include "sensors/learning/scaled_conjugate_gradient.h"

namespace touchstone::sensors {
namespace {

constexpr double kFirstNoiseRatio = 0.1;
constexpr std::uint64_t kSubsetStream = 1;  // beside that of the search

void check(const TuningSettings& settings) {
  const auto need = [](bool holds, const char* name, double value, const char* allowed) {
    if (!holds) fail("tuning: {} is {}, it must be {}", name, value, allowed);
  };
  need(settings.evaluations >= 4, "evaluations", settings.evaluations, "at least 4");
  need(settings.gradient_steps >= 1, "gradient_steps", settings.gradient_steps, "at least 1");
  need(settings.most_samples >= 10, "most_samples", settings.most_samples, "at least 10");
  need(settings.longest > 1.0 && std::isfinite(settings.longest), "longest", settings.longest, "finite and above 1");
  need(settings.least_noise_ratio > 0.0 && settings.least_noise_ratio < kFirstNoiseRatio, "least_noise_ratio",
       settings.least_noise_ratio, "above 0 and below 0.1");
  if (settings.method == TuningMethod::kGradient && settings.aim != TuningAim::kEvidence) {
    fail("tuning: by gradient only the evidence can be made large, '{}' was asked for", name_of(settings.aim));
  }
}

double standard_deviation(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return std::sqrt((values.array() - values.mean()).square().mean());
}

/// `count` of the rows, drawn without putting back, in their order.
std::vector<Eigen::Index> draw_rows(Eigen::Index rows, Eigen::Index count, RandomStream& random) {
  std::vector<Eigen::Index> all(static_cast<std::size_t>(rows));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  if (count >= rows) return all;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const auto left = static_cast<double>(all.size() - i);
    std::swap(all[i], all[i + static_cast<std::size_t>(random.uniform() * left)]);
  }
  all.resize(static_cast<std::size_t>(count));
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

const char* name_of(TuningMethod method) {
  return method == TuningMethod::kBayesian ? "bayesian" : "gradient";
}

const char* name_of(TuningAim aim) {
  return aim == TuningAim::kValidation ? "validation" : "evidence";
}

TunedGaussianProcess tune_gaussian_process(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& targets,
                                           const Eigen::MatrixXd& validation_inputs,
                                           const Eigen::VectorXd& validation_targets, const TuningSettings& settings,
                                           int fold) {
  check(settings);
  if (fold < 0) fail("tuning: fold is {}, it must be at least 0", fold);
  if (inputs.rows() < 2 || inputs.rows() != targets.size() || !inputs.allFinite() || !targets.allFinite()) {
    fail("tuning: {} samples and {} targets; they must be as many, at least 2, and finite", inputs.rows(),
         targets.size());
  }
  if (settings.aim == TuningAim::kValidation) {
    if (validation_targets.size() == 0) fail("tuning: the validation error is asked for, without validation samples");
    if (validation_inputs.rows() != validation_targets.size() || validation_inputs.cols() != inputs.cols() ||
        !validation_inputs.allFinite() || !validation_targets.allFinite()) {
      fail("tuning: {} validation samples of {} inputs with {} targets; {} inputs are needed, all finite",
           validation_inputs.rows(), validation_inputs.cols(), validation_targets.size(), inputs.cols());
    }
  }
  RandomStream random(settings.seed, 2 * static_cast<std::uint64_t>(fold) + kSubsetStream, Purpose::kSearch);
  const std::vector<Eigen::Index> rows = draw_rows(inputs.rows(), settings.most_samples, random);
  const Eigen::MatrixXd some = inputs(rows, Eigen::all);
  const Eigen::VectorXd some_targets = targets(rows);
  const Eigen::Index dimensions = inputs.cols();

  // An input that never changes has any length; targets that never change any signal.
  Eigen::VectorXd unit(dimensions);
  for (Eigen::Index i = 0; i < dimensions; ++i) {
    unit[i] = standard_deviation(inputs.col(i));
    if (!(unit[i] > 0.0)) unit[i] = 1.0;
  }
  double scale = standard_deviation(targets);
  if (!(scale > 0.0)) scale = 1.0;

  TunedGaussianProcess tuned;
  tuned.samples_used = static_cast<int>(rows.size());
  GaussianProcessParameters chosen;
  if (settings.method == TuningMethod::kBayesian) {
    SearchBox box{Eigen::VectorXd::Constant(dimensions + 1, -std::log(settings.longest)),
                  Eigen::VectorXd::Constant(dimensions + 1, std::log(settings.longest))};
    box.low[dimensions] = std::log(settings.least_noise_ratio);
    box.high[dimensions] = 0.0;
    Eigen::VectorXd first = Eigen::VectorXd::Zero(dimensions + 1);
    first[dimensions] = std::log(kFirstNoiseRatio);
    const auto process_at = [&](const Eigen::VectorXd& place) {
      const GaussianProcessParameters parameters{unit.array() * place.head(dimensions).array().exp(), scale,
                                                 scale * std::exp(place[dimensions])};
      return with_best_signal(condition(parameters, some, some_targets));
    };
    const auto cost = [&](const Eigen::VectorXd& place) {
      ++tuned.factorisations;
      try {
        const GaussianProcess process = process_at(place);
        if (settings.aim == TuningAim::kEvidence) return -process.log_evidence / static_cast<double>(rows.size());
        return (predict(process, validation_inputs) - validation_targets).squaredNorm() /
               static_cast<double>(validation_targets.size());
      } catch (const Error&) {  // too little noise to be factorised: the search looks elsewhere
        return std::numeric_limits<double>::infinity();
      }
    };
    BayesianMinimumSettings search;
    search.evaluations = settings.evaluations;
    search.seed = settings.seed;
    search.stream = 2 * static_cast<std::uint64_t>(fold);
    const BayesianMinimum found = find_bayesian_minimum(cost, box, first, search);
    tuned.values = found.values;
    chosen = process_at(found.place).parameters;
    ++tuned.factorisations;
  } else {
    const ValueAndGradient cost = [&](const Eigen::VectorXd& logarithms, Eigen::VectorXd& gradient) {
      ++tuned.factorisations;
      try {
        const GaussianProcess process =
            condition(GaussianProcessParameters::from_logarithms(logarithms), some, some_targets);
        const auto count = static_cast<double>(rows.size());
        gradient = -evidence_gradient(process) / count;
        return -process.log_evidence / count;
      } catch (const Error&) {  // too little noise to be factorised, or a length beyond all measure: no step there
        return std::numeric_limits<double>::infinity();
      }
    };
    Eigen::VectorXd logarithms = GaussianProcessParameters{unit, scale, scale * kFirstNoiseRatio}.logarithms();
    ScaledConjugateGradientSettings descent;
    descent.most_steps = settings.gradient_steps;
    descent.least_gradient = 1e-6;
    minimise_by_scaled_conjugate_gradient(cost, logarithms, descent, [&](int, const Eigen::VectorXd&, double value) {
      tuned.values.push_back(value);
      return false;
    });
    chosen = GaussianProcessParameters::from_logarithms(logarithms);
  }
  tuned.process = condition(chosen, inputs, targets);
  return tuned;
}

}  // namespace touchstone::sensors
