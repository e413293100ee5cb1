#include "fem/fine_relief/layer_kernel.h"

#include <math.h>  // j0 and j1, which are POSIX's

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr double kStep = 0.02;    // of the table
constexpr double kCutOff = 22.0;  // exp(-44) q^3 is nothing beside one
constexpr int kPanels = 16;       // of Gauss' rule over q
constexpr int kPanelPoints = 32;

double capped(double poisson_ratio) {
  return std::min(poisson_ratio, kLargestPoissonRatio);
}

/// M(q) / q, which is even in q and finite at 0.
double layer_over_q(double nu, double q) {
  const double a = 3.0 - 4.0 * nu;
  if (q > 1.0) return layer_over_half_space(nu, q) / q;
  // a sinh 2q - 2q = (2 - 4 nu) 2q + a (sinh 2q - 2q), the last bracket by its series.
  const double x2 = 4.0 * q * q;
  double term = x2 / 6.0;
  double series = 0.0;
  for (int n = 4; term > 1e-17 * series; n += 2) {
    series += term;
    term *= x2 / (n * (n + 1));
  }
  const double sinh_q = std::sinh(q);
  const double bottom = 8.0 * (1.0 - nu) * (1.0 - nu) + 2.0 * a * sinh_q * sinh_q + 2.0 * q * q;
  return (4.0 * (1.0 - 2.0 * nu) + 2.0 * a * series) / bottom;
}

struct GaussRule {
  std::array<double, kPanelPoints> x, w;  // on [-1, 1]
  GaussRule() {
    // Roots of Legendre's polynomial by Newton's iteration [Abramowitz1964, eq. 25.4.29].
    for (int i = 0; i < kPanelPoints; ++i) {
      double z = std::cos(std::numbers::pi * (i + 0.75) / (kPanelPoints + 0.5));
      double slope = 1.0;
      for (int iteration = 0; iteration < 100; ++iteration) {
        double p = 1.0;
        double before = 0.0;
        for (int n = 0; n < kPanelPoints; ++n) {
          const double next = ((2 * n + 1) * z * p - n * before) / (n + 1);
          before = p;
          p = next;
        }
        slope = kPanelPoints * (z * p - before) / (z * z - 1.0);
        const double step = p / slope;
        z -= step;
        if (std::abs(step) < 1e-15) break;
      }
      x[i] = z;
      w[i] = 2.0 / ((1.0 - z * z) * slope * slope);
    }
  }
};

}  // namespace

double layer_less_half_space(double poisson_ratio, double q) {
  const double nu = capped(poisson_ratio);
  const double a = 3.0 - 4.0 * nu;
  const double c = 5.0 - 12.0 * nu + 8.0 * nu * nu;
  const double e = std::exp(-2.0 * q);
  return -(a * e + 2.0 * q * (1.0 + q) + c) * e / (0.5 * a * (1.0 + e * e) + (2.0 * q * q + c) * e);
}

double layer_over_half_space(double poisson_ratio, double q) {
  const double nu = capped(poisson_ratio);
  if (q <= 1.0) return q * layer_over_q(nu, q);
  return 1.0 + layer_less_half_space(nu, q);
}

double layer_compliance(const ElasticMaterial& material, double thickness, double k) {
  const double nu = capped(material.poisson_ratio);
  return 2.0 * (1.0 - nu * nu) * thickness / material.youngs_modulus * layer_over_q(nu, k * thickness);
}

LayerCorrection::LayerCorrection(double poisson_ratio, double largest) {
  static const GaussRule rule;
  std::array<double, kPanels * kPanelPoints> q;
  std::array<double, kPanels * kPanelPoints> weight;
  for (int panel = 0; panel < kPanels; ++panel) {
    for (int i = 0; i < kPanelPoints; ++i) {
      const int k = panel * kPanelPoints + i;
      q[k] = kCutOff / kPanels * (panel + 0.5 * (1.0 + rule.x[i]));
      weight[k] = 0.5 * kCutOff / kPanels * rule.w[i] * layer_less_half_space(poisson_ratio, q[k]);
    }
  }
  const int count = 2 + static_cast<int>(std::ceil(std::min(largest, kReach) / kStep));
  for (int i = 0; i < count; ++i) {
    const double rho = i * kStep;
    double value = 0.0;
    double slope = 0.0;
    double laplacian = 0.0;
    for (std::size_t k = 0; k < q.size(); ++k) {
      const double j = weight[k] * ::j0(q[k] * rho);
      value += j;
      slope -= weight[k] * q[k] * ::j1(q[k] * rho);
      laplacian -= q[k] * q[k] * j;
    }
    value_.push_back(value);
    slope_.push_back(slope);
    laplacian_.push_back(laplacian);
  }
}

double LayerCorrection::value(double rho) const {
  const auto i = static_cast<std::size_t>(rho / kStep);
  TS_ASSERT(i + 1 < value_.size());
  const double t = rho / kStep - static_cast<double>(i);
  const double s = 1.0 - t;
  // Hermite's cubic.
  return (1.0 + 2.0 * t) * s * s * value_[i] + t * s * s * kStep * slope_[i] + t * t * (3.0 - 2.0 * t) * value_[i + 1] -
         t * t * s * kStep * slope_[i + 1];
}

double LayerCorrection::laplacian(double rho) const {
  const auto i = static_cast<std::size_t>(rho / kStep);
  TS_ASSERT(i + 1 < laplacian_.size());
  const double t = rho / kStep - static_cast<double>(i);
  return (1.0 - t) * laplacian_[i] + t * laplacian_[i + 1];
}

}  // namespace touchstone::fem
