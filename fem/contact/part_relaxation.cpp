#include "fem/contact/part_relaxation.h"

namespace touchstone::fem {

void PartRelaxation::begin(const RelaxationHistory& history, double seconds, int n) {
  if (!on()) return;
  step_ = relaxation_step(series_, seconds);
  carried_ = carried_over(step_, history, 6 * static_cast<Eigen::Index>(n));
}

Eigen::Vector3d PartRelaxation::carried(int vertex) const {
  if (carried_.size() == 0) return Eigen::Vector3d::Zero();
  return carried_.segment<3>(carried_.size() / 2 + 3 * vertex);
}

void PartRelaxation::prepare(ContactProblem& problem, const ContactBlock& block) const {
  if (!on()) return;
  const double g = step_.stiffness;
  for (Eigen::Index j = 0; j < problem.gap.size(); ++j) {
    const int v = block.vertices()[static_cast<std::size_t>(j)];
    const Eigen::Vector3d own = block.axes(v).transpose() * carried(v);
    problem.gap[j] = g * problem.gap[j] - own[0];
    if (problem.components == 3) problem.drag.segment<2>(2 * j) = g * problem.drag.segment<2>(2 * j) + own.tail<2>();
  }
  problem.hold /= g;  // the shifts are multiplied by G
}

void PartRelaxation::finish(ContactAnswer& answer, const ContactBlock& block) const {
  if (!on()) return;
  const double g = step_.stiffness;
  answer.shift /= g;
  for (std::size_t k = 0; k < block.vertices().size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const int v = block.vertices()[k];
    const Eigen::Vector3d own = block.axes(v).transpose() * carried(v);
    answer.response.segment<3>(3 * j) = (answer.response.segment<3>(3 * j) - own) / g;
  }
}

RelaxationHistory PartRelaxation::after(const RelaxationHistory& before, const Eigen::VectorXd& traction,
                                        const Eigen::VectorXd& elastic_weighted) const {
  Eigen::VectorXd both(traction.size() + elastic_weighted.size());
  both << traction, elastic_weighted;
  return after_step(step_, before, both);
}

}  // namespace touchstone::fem
