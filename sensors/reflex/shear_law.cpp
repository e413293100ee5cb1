#include "sensors/reflex/shear_law.h"

#include <cmath>

#include "core/dense_solvers.h"
#include "core/error.h"

namespace touchstone::sensors {

ShearLaw fit_shear_law(std::span<const ShearSample> samples) {
  constexpr std::size_t kLeast = 8;
  constexpr double kLeastPivot = 1e-6;  // of the largest: below it a figure can't be separated from the others
  if (samples.size() < kLeast) fail("shear law: {} samples, at least {} are needed", samples.size(), kLeast);
  const auto count = static_cast<Eigen::Index>(samples.size());
  Eigen::Matrix<double, Eigen::Dynamic, 4> terms(count, 4);
  Eigen::Matrix<double, Eigen::Dynamic, 2> forces(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ShearSample& one = samples[static_cast<std::size_t>(i)];
    if (!one.displacement.allFinite() || !std::isfinite(one.normal_N) || !one.shear_N.allFinite()) {
      fail("shear law: sample {} has values that aren't finite", i);
    }
    terms.row(i) << one.displacement.transpose(), one.normal_N * one.displacement.transpose();
    forces.row(i) = one.shear_N.transpose();
  }
  // Columns of one size, or the threshold would depend on the units.
  Eigen::RowVector4d size = terms.colwise().norm();
  for (Eigen::Index i = 0; i < 4; ++i) {
    if (!(size[i] > 0.0)) fail("shear law: all displacements, or all normal forces, are 0");
    terms.col(i) /= size[i];
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors{Eigen::MatrixXd(terms)};
  factors.setThreshold(kLeastPivot);
  if (factors.rank() < 4) {
    fail(
        "shear law: the samples lie along one line or have one normal force; both directions and several normal "
        "forces are needed");
  }
  const Eigen::MatrixXd figures = size.cwiseInverse().transpose().asDiagonal() * factors.solve(Eigen::MatrixXd(forces));
  ShearLaw law;
  law.stiffness = figures.topRows<2>().transpose();
  law.per_N = figures.bottomRows<2>().transpose();
  double squares = 0.0;
  for (const ShearSample& one : samples) {
    squares += (law.force_N(one.displacement, one.normal_N) - one.shear_N).squaredNorm();
  }
  law.rms_residual_N = std::sqrt(squares / static_cast<double>(count));
  return law;
}

}  // namespace touchstone::sensors
