#include "sensors/learning/gaussian_process.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "sensors/numerics/wide_cholesky.h"

namespace touchstone::sensors {
namespace {

/// Squared distances over the lengths, from all rows of `inputs` from `first` on to one place.
Eigen::ArrayXd squared_distances(const Eigen::MatrixXd& inputs, Eigen::Index first, const Eigen::RowVectorXd& place,
                                 const Eigen::VectorXd& lengths) {
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(inputs.rows() - first);
  for (Eigen::Index m = 0; m < inputs.cols(); ++m) {
    sum += ((inputs.col(m).tail(sum.size()).array() - place[m]) / lengths[m]).square();
  }
  return sum;
}

void check_places(const GaussianProcess& process, const Eigen::MatrixXd& places) {
  if (places.cols() != process.inputs.cols()) {
    fail("Gaussian process: places have {} inputs, the process has {}", places.cols(), process.inputs.cols());
  }
  if (!places.allFinite()) fail("Gaussian process: an input of a place isn't finite");
}

/// k of all samples (rows) at places first to first + count - 1 (columns).
Eigen::MatrixXd covariances(const GaussianProcess& process, const Eigen::MatrixXd& places, Eigen::Index first,
                            Eigen::Index count) {
  const GaussianProcessParameters& p = process.parameters;
  Eigen::MatrixXd result(process.inputs.rows(), count);
  for (Eigen::Index j = 0; j < count; ++j) {
    result.col(j) =
        p.signal * p.signal * (-0.5 * squared_distances(process.inputs, 0, places.row(first + j), p.lengths)).exp();
  }
  return result;
}

constexpr Eigen::Index kPlacesAtOnce = 64;

}  // namespace

Eigen::VectorXd GaussianProcessParameters::logarithms() const {
  Eigen::VectorXd result(lengths.size() + 2);
  result << lengths.array().log().matrix(), std::log(signal), std::log(noise);
  return result;
}

GaussianProcessParameters GaussianProcessParameters::from_logarithms(const Eigen::VectorXd& logarithms) {
  TS_ASSERT(logarithms.size() >= 3);
  const Eigen::VectorXd values = logarithms.array().exp();
  const Eigen::Index inputs = values.size() - 2;
  return {values.head(inputs), values[inputs], values[inputs + 1]};
}

GaussianProcess condition(const GaussianProcessParameters& parameters, const Eigen::MatrixXd& inputs,
                          const Eigen::VectorXd& targets) {
  const Eigen::Index n = inputs.rows();
  if (n < 1 || inputs.cols() < 1) fail("Gaussian process: {} samples of {} inputs", n, inputs.cols());
  if (n > kMostGaussianProcessSamples) {
    fail("Gaussian process: {} samples; at most {} are taken", n, kMostGaussianProcessSamples);
  }
  if (targets.size() != n) fail("Gaussian process: {} samples have {} targets", n, targets.size());
  if (!inputs.allFinite()) fail("Gaussian process: an input isn't finite");
  if (!targets.allFinite()) fail("Gaussian process: a target isn't finite");
  if (parameters.lengths.size() != inputs.cols()) {
    fail("Gaussian process: {} lengths for {} inputs", parameters.lengths.size(), inputs.cols());
  }
  const auto above_zero = [](const char* name, double value) {
    if (!(std::isfinite(value) && value > 0.0)) {
      fail("Gaussian process: {} is {}, it must be finite and above 0", name, value);
    }
  };
  for (const double length : parameters.lengths) above_zero("a length", length);
  above_zero("signal", parameters.signal);
  above_zero("noise", parameters.noise);

  GaussianProcess process{.parameters = parameters,
                          .inputs = inputs,
                          .targets = targets,
                          .mean = targets.mean(),
                          .weights = {},
                          .factor = Eigen::MatrixXd(n, n)};
  const double signal_square = parameters.signal * parameters.signal;
  for (Eigen::Index j = 0; j < n; ++j) {
    process.factor.col(j).tail(n - j) =
        signal_square * (-0.5 * squared_distances(inputs, j, inputs.row(j), parameters.lengths)).exp();
    process.factor(j, j) += parameters.noise * parameters.noise;
  }
  // A pivot is what a sample's variance has beside the samples before it. Of samples that repeat each other only the
  // noise is left of it, and rounding of the whole may be more than that.
  const auto is_lost_in_rounding = [&] {
    constexpr double kPerSample = 100.0 * std::numeric_limits<double>::epsilon();
    const double least = process.factor.diagonal().minCoeff();
    return !(least * least > kPerSample * static_cast<double>(n) * signal_square);
  };
  if (!factorise_in_place(process.factor) || is_lost_in_rounding()) {
    fail(
        "Gaussian process: with a noise of {} beside a signal of {} the samples' covariance can't be factorised; more "
        "noise is needed",
        parameters.noise, parameters.signal);
  }
  const Eigen::VectorXd centred = targets.array() - process.mean;
  process.weights = solve_by_factor(process.factor, centred);
  process.log_evidence = -0.5 * centred.dot(process.weights) - half_log_determinant(process.factor) -
                         0.5 * static_cast<double>(n) * std::log(2.0 * std::numbers::pi);
  return process;
}

Eigen::VectorXd evidence_gradient(const GaussianProcess& process) {
  const GaussianProcessParameters& p = process.parameters;
  const Eigen::Index n = process.inputs.rows();
  const Eigen::Index inputs = process.inputs.cols();
  const Eigen::MatrixXd inverse = inverse_by_factor(process.factor);
  // Half the trace of (w w^T - K^-1) dK, dK symmetric: the diagonal once, what is below it twice.
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(inputs + 2);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index below = n - j - 1;
    const double diagonal = process.weights[j] * process.weights[j] - inverse(j, j);
    gradient[inputs] += diagonal * p.signal * p.signal;
    gradient[inputs + 1] += diagonal * p.noise * p.noise;
    if (below == 0) continue;
    const Eigen::ArrayXd distances = squared_distances(process.inputs, j + 1, process.inputs.row(j), p.lengths);
    const Eigen::ArrayXd share =
        (process.weights.tail(below).array() * process.weights[j] - inverse.col(j).tail(below).array()) *
        (p.signal * p.signal * (-0.5 * distances).exp());
    gradient[inputs] += 2.0 * share.sum();
    for (Eigen::Index m = 0; m < inputs; ++m) {
      const auto difference = (process.inputs.col(m).tail(below).array() - process.inputs(j, m)) / p.lengths[m];
      gradient[m] += (share * difference.square()).sum();
    }
  }
  return gradient;
}

GaussianProcess with_best_signal(GaussianProcess process) {
  const auto n = static_cast<double>(process.targets.size());
  const double fit = (process.targets.array() - process.mean).matrix().dot(process.weights);
  const double square = fit / n;  // of the factor by which all standard deviations grow
  if (!(square > 0.0)) return process;
  const double factor = std::sqrt(square);
  process.parameters.signal *= factor;
  process.parameters.noise *= factor;
  process.factor *= factor;
  process.weights /= square;
  process.log_evidence += 0.5 * fit - 0.5 * n - 0.5 * n * std::log(square);
  return process;
}

Eigen::VectorXd predict(const GaussianProcess& process, const Eigen::MatrixXd& places) {
  check_places(process, places);
  Eigen::VectorXd mean(places.rows());
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    mean[i] = process.mean + covariances(process, places, i, 1).col(0).dot(process.weights);
  }
  return mean;
}

GaussianProcessPrediction predict_with_variance(const GaussianProcess& process, const Eigen::MatrixXd& places) {
  GaussianProcessPrediction prediction{predict(process, places), Eigen::VectorXd(places.rows())};
  const double prior = process.parameters.signal * process.parameters.signal;
  for (Eigen::Index first = 0; first < places.rows(); first += kPlacesAtOnce) {
    const Eigen::Index count = std::min(kPlacesAtOnce, places.rows() - first);
    Eigen::MatrixXd block = covariances(process, places, first, count);
    process.factor.triangularView<Eigen::Lower>().solveInPlace(block);
    prediction.variance.segment(first, count) = (prior - block.colwise().squaredNorm().array()).max(0.0).transpose();
  }
  return prediction;
}

}  // namespace touchstone::sensors
