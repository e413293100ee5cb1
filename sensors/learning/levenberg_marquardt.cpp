#include "sensors/learning/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "sensors/learning/early_stopping.h"
#include "sensors/numerics/wide_cholesky.h"
#include "sensors/numerics/wide_product.h"

namespace touchstone::sensors {
namespace {

/// J^T, parameters x samples.
Eigen::MatrixXd transposed_jacobian(const LayerValues& values, const std::vector<Eigen::MatrixXd>& by_sums,
                                    Eigen::Index parameters) {
  const Eigen::Index samples = values.front().cols();
  Eigen::MatrixXd result(parameters, samples);
  for (Eigen::Index sample = 0; sample < samples; ++sample) {
    double* next = &result.coeffRef(0, sample);
    for (std::size_t i = 0; i < by_sums.size(); ++i) {
      const Eigen::Index units = by_sums[i].rows();
      for (Eigen::Index input = 0; input < values[i].rows(); ++input) {
        Eigen::Map<Eigen::VectorXd>(next, units) = values[i](input, sample) * by_sums[i].col(sample);
        next += units;
      }
      Eigen::Map<Eigen::VectorXd>(next, units) = by_sums[i].col(sample);
      next += units;
    }
  }
  return result;
}

/// J J^T, the lower triangle, block by block so that a layer's two products stay in cache.
Eigen::MatrixXd dual_matrix(const LayerValues& values, const std::vector<Eigen::MatrixXd>& by_sums) {
  constexpr Eigen::Index kBlock = 192;
  const Eigen::Index samples = values.front().cols();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(samples, samples);
  for (std::size_t layer = 0; layer < by_sums.size(); ++layer) {
    const Eigen::MatrixXd back = by_sums[layer].transpose();
    const Eigen::MatrixXd in = values[layer].transpose();
    for (Eigen::Index j = 0; j < samples; j += kBlock) {
      const Eigen::Index columns = std::min(kBlock, samples - j);
      for (Eigen::Index i = j; i < samples; i += kBlock) {
        const Eigen::Index rows = std::min(kBlock, samples - i);
        Eigen::MatrixXd less_back = Eigen::MatrixXd::Zero(rows, columns);
        Eigen::MatrixXd less_in = Eigen::MatrixXd::Constant(rows, columns, -1.0);
        subtract_product(less_back, back.middleRows(i, rows), back.middleRows(j, columns));
        subtract_product(less_in, in.middleRows(i, rows), in.middleRows(j, columns));
        result.block(i, j, rows, columns).array() += less_back.array() * less_in.array();
      }
    }
  }
  return result;
}

/// J^T x: the gradient of samples that have weights.
Eigen::VectorXd weighted_gradient(const LayerValues& values, std::vector<Eigen::MatrixXd> by_sums,
                                  const Eigen::VectorXd& weights) {
  for (Eigen::MatrixXd& layer : by_sums) layer = layer * weights.asDiagonal();
  return sum_gradient(values, by_sums);
}

StepForm cheaper_form(const FeedForwardNetwork& network, Eigen::Index samples) {
  const auto m = static_cast<double>(samples);
  const auto p = static_cast<double>(network.parameters());
  double widths = 0.0;
  for (const Eigen::MatrixXd& layer : network.weights) widths += static_cast<double>(layer.rows() + layer.cols());
  const double normal = m * p * p + p * p * p / 3.0;
  const double dual = m * m * widths + m * m * m / 3.0;
  return normal <= dual ? StepForm::kNormal : StepForm::kDual;
}

void check(const LevenbergMarquardtSettings& s) {
  const auto need = [](bool holds, const char* name, double value, const char* allowed) {
    if (!holds) fail("Levenberg-Marquardt: {} is {}, it must be {}", name, value, allowed);
  };
  need(s.least_damping > 0.0, "least_damping", s.least_damping, "above 0");
  need(s.first_damping >= s.least_damping, "first_damping", s.first_damping, "at least least_damping");
  need(s.most_damping >= s.first_damping && std::isfinite(s.most_damping), "most_damping", s.most_damping,
       "finite and at least first_damping");
  need(s.damping_up > 1.0 && std::isfinite(s.damping_up), "damping_up", s.damping_up, "finite and above 1");
  need(s.damping_down > 0.0 && s.damping_down < 1.0, "damping_down", s.damping_down, "above 0 and below 1");
  need(s.least_gradient >= 0.0, "least_gradient", s.least_gradient, "at least 0");
  need(s.most_steps >= 1, "most_steps", s.most_steps, "at least 1");
  need(s.patience >= 1, "patience", s.patience, "at least 1");
}

void check(const FeedForwardNetwork& network, const NetworkSamples& samples, const char* name) {
  if (samples.inputs.cols() != samples.targets.cols()) {
    fail("Levenberg-Marquardt: {} samples have {} inputs and {} targets", name, samples.inputs.cols(),
         samples.targets.cols());
  }
  if (samples.inputs.cols() == 0) return;
  if (samples.inputs.rows() != network.inputs() || samples.targets.rows() != 1) {
    fail("Levenberg-Marquardt: {} samples of {} inputs and {} targets; the network has {} and 1", name,
         samples.inputs.rows(), samples.targets.rows(), network.inputs());
  }
  if (!samples.inputs.allFinite() || !samples.targets.allFinite()) {
    fail("Levenberg-Marquardt: a value of the {} samples isn't finite", name);
  }
}

double sum_of_squares(const FeedForwardNetwork& network, const NetworkSamples& samples) {
  return (evaluate(network, samples.inputs) - samples.targets).squaredNorm();
}

}  // namespace

LevenbergMarquardtSystem::LevenbergMarquardtSystem(const FeedForwardNetwork& network, const NetworkSamples& samples,
                                                   StepForm form)
    : form_(form) {
  TS_ASSERT(network.outputs() == 1 && samples.targets.rows() == 1 && samples.inputs.cols() > 0);
  TS_ASSERT(samples.inputs.cols() == samples.targets.cols());
  const Eigen::Index count = samples.inputs.cols();
  if (form_ == StepForm::kCheaper) form_ = cheaper_form(network, count);
  values_ = run_forward(network, samples.inputs);
  errors_ = (values_.back() - samples.targets).transpose();
  by_sums_ = run_backward(network, values_, Eigen::MatrixXd::Ones(1, count));
  gradient_ = weighted_gradient(values_, by_sums_, errors_);
  if (form_ == StepForm::kDual) {
    matrix_ = dual_matrix(values_, by_sums_);
  } else {
    const Eigen::MatrixXd derivatives = transposed_jacobian(values_, by_sums_, network.parameters());
    matrix_ = Eigen::MatrixXd::Zero(derivatives.rows(), derivatives.rows());
    subtract_product(matrix_, derivatives, derivatives, ProductPart::kLower);
    matrix_ = -matrix_;
  }
}

std::optional<Eigen::VectorXd> LevenbergMarquardtSystem::step(double damping) const {
  Eigen::MatrixXd factor = matrix_;
  factor.diagonal().array() += damping;
  if (!factorise_in_place(factor)) return std::nullopt;
  if (form_ == StepForm::kNormal) return -solve_by_factor(factor, gradient_);
  return -weighted_gradient(values_, by_sums_, solve_by_factor(factor, errors_));
}

Eigen::MatrixXd jacobian(const FeedForwardNetwork& network, const Eigen::MatrixXd& inputs) {
  TS_ASSERT(network.outputs() == 1);
  const LayerValues values = run_forward(network, inputs);
  const auto by_sums = run_backward(network, values, Eigen::MatrixXd::Ones(1, inputs.cols()));
  return transposed_jacobian(values, by_sums, network.parameters()).transpose();
}

const char* name_of(NetworkTrainingEnd end) {
  switch (end) {
    case NetworkTrainingEnd::kValidation:
      return "validation";
    case NetworkTrainingEnd::kFlat:
      return "flat";
    case NetworkTrainingEnd::kStuck:
      return "stuck";
    case NetworkTrainingEnd::kOutOfSteps:
      return "out of steps";
  }
  return "?";
}

NetworkTrainingReport train_by_levenberg_marquardt(FeedForwardNetwork& network, const NetworkSamples& training,
                                                   const NetworkSamples& validation,
                                                   const LevenbergMarquardtSettings& settings) {
  check(settings);
  const std::string fault = fault_of(network);
  if (!fault.empty()) fail("Levenberg-Marquardt: {}", fault);
  if (network.outputs() != 1) fail("Levenberg-Marquardt: the network has {} outputs, 1 is needed", network.outputs());
  check(network, training, "training");
  check(network, validation, "validation");
  const Eigen::Index count = training.inputs.cols();
  if (count == 0) fail("Levenberg-Marquardt: there is no training sample");

  NetworkTrainingReport report;
  const bool validates = validation.inputs.cols() > 0;
  EarlyStopping stopping(settings.patience);
  const auto should_stop = [&](int step, double sum) {
    const double loss =
        validates ? sum_of_squares(network, validation) / static_cast<double>(validation.inputs.cols()) : 0.0;
    report.history.push_back({sum / static_cast<double>(count), loss});
    return validates && stopping.shows(step, loss, parameters_of(network));
  };
  should_stop(0, sum_of_squares(network, training));

  double damping = settings.first_damping;
  bool stuck = false;
  while (report.steps < settings.most_steps) {
    const LevenbergMarquardtSystem system(network, training, settings.form);
    if (!(system.half_gradient().cwiseAbs().maxCoeff() > settings.least_gradient)) {
      report.end = NetworkTrainingEnd::kFlat;
      break;
    }
    const Eigen::VectorXd from = parameters_of(network);
    double sum = 0.0;
    bool failed = false;
    for (;;) {
      ++report.factorisations;
      if (const auto step = system.step(damping)) {
        set_parameters(network, from + *step);
        sum = sum_of_squares(network, training);
        if (sum < system.sum_of_squares()) break;
      }
      if (damping >= settings.most_damping) {
        stuck = true;
        break;
      }
      failed = true;
      damping = std::min(settings.most_damping, damping * settings.damping_up);
    }
    if (stuck) {
      set_parameters(network, from);
      report.end = NetworkTrainingEnd::kStuck;
      break;
    }
    // Less damping has just failed where there was a second try: it isn't tried again at once.
    if (!failed) damping = std::max(settings.least_damping, damping * settings.damping_down);
    ++report.steps;
    if (should_stop(report.steps, sum)) {
      report.end = NetworkTrainingEnd::kValidation;
      break;
    }
  }
  report.best_step = report.steps;
  if (validates && stopping.best().size() > 0) {
    set_parameters(network, stopping.best());
    report.best_step = stopping.best_step();
  }
  return report;
}

}  // namespace touchstone::sensors
