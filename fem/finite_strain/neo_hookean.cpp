#include "fem/finite_strain/neo_hookean.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace touchstone::fem {

double energy(const NeoHookean& material, const Eigen::Matrix3d& gradient, double q) {
  const double volume_ratio = gradient.determinant();
  if (!(volume_ratio > 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  return material.shear * (0.5 * (gradient.squaredNorm() - 3.0) - std::log(volume_ratio)) -
         material.pressure_scale * q * (volume_ratio - 1.0) - 0.5 * material.compressibility * q * q;
}

NeoHookeanStress stress(const NeoHookean& material, const Eigen::Matrix3d& gradient, double q) {
  const double volume_ratio = gradient.determinant();
  const Eigen::Matrix3d inverse = gradient.inverse().transpose();
  NeoHookeanStress result;
  result.stress = material.shear * gradient - (material.shear + material.pressure_scale * q * volume_ratio) * inverse;
  result.volume = -material.pressure_scale * (volume_ratio - 1.0) - material.compressibility * q;
  return result;
}

NeoHookeanStress stress_change(const NeoHookean& material, const Eigen::Matrix3d& gradient, double q,
                               const Eigen::Matrix3d& gradient_change, double q_change) {
  const double volume_ratio = gradient.determinant();
  const Eigen::Matrix3d inverse = gradient.inverse().transpose();
  const double pressure = material.pressure_scale * q * volume_ratio;
  const double dilation = inverse.cwiseProduct(gradient_change).sum();  // dJ / J
  NeoHookeanStress result;
  result.stress = material.shear * gradient_change +
                  (material.shear + pressure) * inverse * gradient_change.transpose() * inverse -
                  (pressure * dilation + material.pressure_scale * volume_ratio * q_change) * inverse;
  result.volume = -material.pressure_scale * volume_ratio * dilation - material.compressibility * q_change;
  return result;
}

}  // namespace touchstone::fem
