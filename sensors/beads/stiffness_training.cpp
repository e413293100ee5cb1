#include "sensors/beads/stiffness_training.h"

#include <algorithm>
#include <cmath>

#include "core/dense_solvers.h"
#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// One trained number: an entry of one square's matrix, and the mirrored entry too in the symmetric form.
struct Coefficient {
  int square;
  int row;
  int column;
  bool mirrored;
};

std::vector<Coefficient> coefficients_of(MatrixForm form, int squares) {
  std::vector<Coefficient> list;
  for (int square = 0; square < squares; ++square) {
    for (int axis = 0; axis < 3; ++axis) list.push_back({square, axis, axis, false});
    if (form == MatrixForm::kDiagonal) continue;
    for (int axis = 0; axis < 2; ++axis) list.push_back({square, 2, axis, form == MatrixForm::kSymmetric});
  }
  return list;
}

void check(const ForceSamples& samples, const TrainingSettings& settings) {
  if (samples.grid < 2 || samples.grid > 32) fail("training: grid is {}, it must be from 2 to 32", samples.grid);
  const auto beads = static_cast<std::size_t>(samples.grid) * static_cast<std::size_t>(samples.grid);
  if (samples.rest.size() != beads) {
    fail("training: {} rest positions were given, a grid of {} has {}", samples.rest.size(), samples.grid, beads);
  }
  for (const Eigen::Vector2d& position : samples.rest) {
    if (!position.allFinite()) fail("training: a rest position isn't finite");
  }
  if (samples.positions.empty()) fail("training: there are no samples");
  if (samples.positions.size() != samples.forces.size()) {
    fail("training: {} lists of positions but {} forces were given", samples.positions.size(), samples.forces.size());
  }
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    if (samples.positions[i].size() != beads) {
      fail("training: sample {} has {} positions, a grid of {} has {}", i, samples.positions[i].size(), samples.grid,
           beads);
    }
    for (const Eigen::Vector2d& position : samples.positions[i]) {
      if (!position.allFinite()) fail("training: a position of sample {} isn't finite", i);
    }
    if (!samples.forces[i].allFinite()) fail("training: the force of sample {} isn't finite", i);
  }
  if (!(settings.loss_drop > 1.0)) fail("training: loss_drop is {}, it must be above 1", settings.loss_drop);
  if (!(settings.least_improvement > 0.0 && settings.least_improvement < 1.0)) {
    fail("training: least_improvement is {}, it must be between 0 and 1", settings.least_improvement);
  }
  if (settings.max_iterations < 1) {
    fail("training: max_iterations is {}, it must be at least 1", settings.max_iterations);
  }
}

/// The loss as a quadratic form, per axis: N loss(theta) = theta' normal theta - 2 right . theta + square.
struct AxisForm {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  double square = 0.0;

  double loss(const Eigen::VectorXd& theta, double samples) const {
    return std::max(0.0, (theta.dot(normal * theta) - 2.0 * right.dot(theta) + square) / samples);
  }
};

/// U of one sample [VisioHaptic2024, fig. 3]: 3 x squares.
Eigen::Matrix3Xd box_sums(const std::vector<Eigen::Vector2d>& positions, const Eigen::Matrix3Xd& rest, int grid) {
  const int squares = grid - 1;
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, squares * squares);
  for (int row = 0; row < grid; ++row) {
    for (int column = 0; column < grid; ++column) {
      const Eigen::Vector3d dp = bead_coordinates(positions, grid, row, column) - rest.col(row * grid + column);
      for (int i = std::max(row - 1, 0); i <= std::min(row, squares - 1); ++i) {
        for (int j = std::max(column - 1, 0); j <= std::min(column, squares - 1); ++j) u.col(i * squares + j) += dp;
      }
    }
  }
  return u;
}

/// Reads the samples once: fills the forms and the range of dP.
void accumulate(const ForceSamples& samples, const std::vector<Coefficient>& coefficients, AxisForm (&axes)[3],
                StiffnessForceModel& model) {
  const auto size = static_cast<Eigen::Index>(coefficients.size());
  const int grid = samples.grid;
  Eigen::Matrix3Xd rest(3, grid * grid);
  for (int bead = 0; bead < grid * grid; ++bead) {
    rest.col(bead) = bead_coordinates(samples.rest, grid, bead / grid, bead % grid);
  }
  for (AxisForm& axis : axes) {
    axis.normal = Eigen::MatrixXd::Zero(size, size);
    axis.right = Eigen::VectorXd::Zero(size);
  }
  model.lowest_seen.assign(static_cast<std::size_t>(grid * grid), Eigen::Vector3d::Zero());
  model.highest_seen = model.lowest_seen;

  constexpr std::size_t kBatch = 256;
  Eigen::MatrixXd features[3];
  Eigen::VectorXd forces[3];
  for (std::size_t begin = 0; begin < samples.positions.size(); begin += kBatch) {
    const std::size_t end = std::min(begin + kBatch, samples.positions.size());
    for (int axis = 0; axis < 3; ++axis) {
      features[axis] = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(end - begin), size);
      forces[axis].resize(static_cast<Eigen::Index>(end - begin));
    }
    for (std::size_t sample = begin; sample < end; ++sample) {
      const auto line = static_cast<Eigen::Index>(sample - begin);
      const std::vector<Eigen::Vector2d>& positions = samples.positions[sample];
      for (int bead = 0; bead < grid * grid; ++bead) {
        const Eigen::Vector3d dp = bead_coordinates(positions, grid, bead / grid, bead % grid) - rest.col(bead);
        const auto i = static_cast<std::size_t>(bead);
        model.lowest_seen[i] = model.lowest_seen[i].cwiseMin(dp);
        model.highest_seen[i] = model.highest_seen[i].cwiseMax(dp);
      }
      const Eigen::Matrix3Xd u = box_sums(positions, rest, grid);
      for (Eigen::Index k = 0; k < size; ++k) {
        const Coefficient& c = coefficients[static_cast<std::size_t>(k)];
        features[c.row](line, k) = u(c.column, c.square);
        if (c.mirrored) features[c.column](line, k) = u(c.row, c.square);
      }
      for (int axis = 0; axis < 3; ++axis) forces[axis][line] = samples.forces[sample][axis];
    }
    for (int axis = 0; axis < 3; ++axis) {
      axes[axis].normal.noalias() += features[axis].transpose() * features[axis];
      axes[axis].right.noalias() += features[axis].transpose() * forces[axis];
      axes[axis].square += forces[axis].squaredNorm();
    }
  }
}

/// 1, 2, 5, 10, 20, 50, ...
bool is_recorded(std::int64_t iteration) {
  while (iteration >= 10 && iteration % 10 == 0) iteration /= 10;
  return iteration == 1 || iteration == 2 || iteration == 5;
}

/// Gradient descent from zero on the scaled form. Fills iterations, end and history; returns the coefficients.
Eigen::VectorXd descend(const AxisForm (&axes)[3], double samples, TrainingReport& report) {
  const TrainingSettings& settings = report.settings;
  Eigen::MatrixXd normal = axes[0].normal + axes[1].normal + axes[2].normal;
  Eigen::VectorXd right = axes[0].right + axes[1].right + axes[2].right;
  const double square = axes[0].square + axes[1].square + axes[2].square;

  // A feature that is always 0 keeps its coefficient at 0 by any scale.
  Eigen::VectorXd scale = normal.diagonal().cwiseSqrt();
  for (double& value : scale) value = value > 0.0 ? 1.0 / value : 1.0;
  normal = (scale.asDiagonal() * normal * scale.asDiagonal()).eval();
  right = right.cwiseProduct(scale);
  const double largest =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(normal, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  if (!std::isfinite(largest)) fail("training: the positions are beyond all measure");
  if (!(largest > 0.0)) fail("training: no bead moves in any sample");

  const auto record = [&](std::int64_t iteration, const Eigen::VectorXd& at) {
    const Eigen::VectorXd theta = at.cwiseProduct(scale);
    report.history.push_back(
        {iteration, {axes[0].loss(theta, samples), axes[1].loss(theta, samples), axes[2].loss(theta, samples)}});
  };
  Eigen::VectorXd at = Eigen::VectorXd::Zero(right.size());
  Eigen::VectorXd ahead = at;  // where the gradient is taken; = at without momentum
  Eigen::VectorXd before = at;
  Eigen::VectorXd gradient(right.size());  // half the loss's, as half its second derivative is `normal`
  double momentum = 1.0;
  record(0, at);
  // The quadratic form is a small difference of large numbers near a perfect fit: below this it has no digits left.
  const double noise = 1e-15 * square;

  report.end = TrainingEnd::kOutOfIterations;
  for (std::int64_t iteration = 1; iteration <= settings.max_iterations; ++iteration) {
    gradient.noalias() = normal * ahead;
    gradient -= right;
    before = at;
    at = ahead - gradient / largest;
    report.iterations = iteration;
    if (is_recorded(iteration)) record(iteration, at);

    const double loss_ahead = square + ahead.dot(gradient - right);
    // The step lowers the loss by at least this, exactly known even where the loss itself is rounding noise.
    const double improvement = gradient.squaredNorm() / largest;
    if (settings.stop == StopRule::kLossDrop) {
      const double loss = square + at.dot(normal * at - 2.0 * right);
      if (loss * settings.loss_drop <= square) {
        report.end = TrainingEnd::kLossDropped;
        break;
      }
    }
    if (improvement <= settings.least_improvement * std::max(loss_ahead, noise)) {
      report.end = TrainingEnd::kConverged;
      break;
    }
    if (!settings.momentum) {
      ahead = at;
    } else if (gradient.dot(at - before) > 0.0) {  // uphill: the momentum has carried too far
      momentum = 1.0;
      ahead = at;
    } else {
      const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum));
      ahead = at + ((momentum - 1.0) / next) * (at - before);
      momentum = next;
    }
  }
  if (report.history.back().iteration != report.iterations) record(report.iterations, at);
  return at.cwiseProduct(scale);
}

}  // namespace

const char* name_of(TrainingEnd end) {
  switch (end) {
    case TrainingEnd::kLossDropped:
      return "loss dropped";
    case TrainingEnd::kConverged:
      return "converged";
    case TrainingEnd::kOutOfIterations:
      return "out of iterations";
  }
  return "?";
}

TrainedModel train(const ForceSamples& samples, const TrainingSettings& settings) {
  check(samples, settings);
  TrainedModel trained;
  StiffnessForceModel& model = trained.model;
  TrainingReport& report = trained.report;
  report.settings = settings;
  model.grid = samples.grid;
  model.form = settings.form;
  model.rest = samples.rest;
  const int squares = (samples.grid - 1) * (samples.grid - 1);
  const std::vector<Coefficient> coefficients = coefficients_of(settings.form, squares);

  AxisForm axes[3];
  accumulate(samples, coefficients, axes, model);
  const auto count = static_cast<double>(samples.positions.size());
  for (int axis = 0; axis < 3; ++axis) report.first_loss[axis] = axes[axis].square / count;
  if (report.first_loss.isZero(0.0)) fail("training: the force is 0 in all {} samples", samples.positions.size());

  const Eigen::VectorXd theta = descend(axes, count, report);
  model.stiffness.assign(static_cast<std::size_t>(squares), Eigen::Matrix3d::Zero());
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    const Coefficient& c = coefficients[k];
    Eigen::Matrix3d& h = model.stiffness[static_cast<std::size_t>(c.square)];
    h(c.row, c.column) = theta[static_cast<Eigen::Index>(k)];
    if (c.mirrored) h(c.column, c.row) = theta[static_cast<Eigen::Index>(k)];
  }

  // The figures that are reported come from the model as it will be used, not from the quadratic form.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < samples.forces.size(); ++i) {
    const Eigen::Vector3d error = estimate_force(model, samples.positions[i], samples.rest) - samples.forces[i];
    report.final_loss += error.cwiseAbs2() / count;
    mean += samples.forces[i] / count;
  }
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& force : samples.forces) variance += (force - mean).cwiseAbs2() / count;
  for (int axis = 0; axis < 3; ++axis) {
    const bool constant = variance[axis] <= 1e-24 * report.first_loss[axis];
    report.r2[axis] = constant ? 0.0 : 1.0 - report.final_loss[axis] / variance[axis];
  }
  model.training = {.samples = static_cast<std::int64_t>(samples.positions.size()),
                    .stop = settings.stop,
                    .iterations = report.iterations,
                    .rms_error_N = report.final_loss.cwiseSqrt()};
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("training: {} (are the positions or forces beyond all measure?)", fault);
  return trained;
}

}  // namespace touchstone::sensors
