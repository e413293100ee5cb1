#include "render/cameras/lens_distortion.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace touchstone::render {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// A polynomial in r^2: coefficients from the constant one up.
using Polynomial = Eigen::VectorXd;

Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial c = Polynomial::Zero(a.size() + b.size() - 1);
  for (Eigen::Index i = 0; i < a.size(); ++i) c.segment(i, b.size()) += a[i] * b;
  return c;
}

/// q times the derivative by q.
Polynomial q_times_derivative(const Polynomial& a) {
  Polynomial c = a;
  for (Eigen::Index i = 0; i < a.size(); ++i) c[i] *= static_cast<double>(i);
  return c;
}

/// The smallest root above 0, as an eigenvalue of the companion matrix; infinite without one. @pre a[0] is 1
double smallest_positive_root(const Polynomial& a) {
  Eigen::Index degree = a.size() - 1;
  while (degree > 0 && a[degree] == 0.0) --degree;
  if (degree == 0) return kInfinite;
  // In 1/q the polynomial is q^degree + a1 q^(degree-1) ...: monic, so small leading coefficients do no harm. The
  // largest positive root of that is sought.
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
  companion.row(0) = -a.segment(1, degree).transpose();
  if (degree > 1) companion.block(1, 0, degree - 1, degree - 1).setIdentity();
  const Eigen::VectorXcd roots = companion.eigenvalues();
  double largest = 0.0;
  for (const std::complex<double>& root : roots) {
    if (root.real() > 0.0 && std::abs(root.imag()) <= 1e-7 * root.real()) largest = std::max(largest, root.real());
  }
  return largest > 0.0 ? 1.0 / largest : kInfinite;
}

/// Radial factor R(q) and its derivative by q = r^2.
struct RadialFactor {
  double value, derivative;
};

RadialFactor radial_factor(const LensDistortion& d, double q) {
  const double top = 1.0 + q * (d.k1 + q * (d.k2 + q * d.k3));
  const double below = 1.0 + q * (d.k4 + q * (d.k5 + q * d.k6));
  const double top_q = d.k1 + q * (2.0 * d.k2 + q * 3.0 * d.k3);
  const double below_q = d.k4 + q * (2.0 * d.k5 + q * 3.0 * d.k6);
  return {top / below, (top_q * below - top * below_q) / (below * below)};
}

}  // namespace

Eigen::Vector2d distort(const LensDistortion& d, const Eigen::Vector2d& undistorted) {
  const double x = undistorted.x();
  const double y = undistorted.y();
  const double q = x * x + y * y;
  const double factor = radial_factor(d, q).value;
  return {x * factor + 2.0 * d.p1 * x * y + d.p2 * (q + 2.0 * x * x),
          y * factor + d.p1 * (q + 2.0 * y * y) + 2.0 * d.p2 * x * y};
}

Eigen::Matrix2d distort_derivative(const LensDistortion& d, const Eigen::Vector2d& undistorted) {
  const double x = undistorted.x();
  const double y = undistorted.y();
  const RadialFactor factor = radial_factor(d, x * x + y * y);
  const double mixed = 2.0 * x * y * factor.derivative + 2.0 * d.p1 * x + 2.0 * d.p2 * y;
  Eigen::Matrix2d derivative;
  derivative << factor.value + 2.0 * x * x * factor.derivative + 2.0 * d.p1 * y + 6.0 * d.p2 * x, mixed, mixed,
      factor.value + 2.0 * y * y * factor.derivative + 6.0 * d.p1 * y + 2.0 * d.p2 * x;
  return derivative;
}

DistortionReach radial_reach(const LensDistortion& d) {
  const Polynomial top = Eigen::Vector4d(1.0, d.k1, d.k2, d.k3);
  const Polynomial below = Eigen::Vector4d(1.0, d.k4, d.k5, d.k6);
  // r R(r^2) has the derivative R + 2 q R'(q); times the denominator's square:
  const Polynomial slope =
      product(top, below) + 2.0 * (product(q_times_derivative(top), below) - product(top, q_times_derivative(below)));
  const double turn = smallest_positive_root(slope);
  const double pole = smallest_positive_root(below);
  if (pole <= turn) return {std::sqrt(pole), kInfinite};
  return {std::sqrt(turn), std::sqrt(turn) * radial_factor(d, turn).value};
}

std::optional<Eigen::Vector2d> undistort(const LensDistortion& distortion, const DistortionReach& reach,
                                         const Eigen::Vector2d& distorted) {
  constexpr int kMostSteps = 100;
  constexpr int kMostHalvings = 40;
  constexpr double kGoal = 1e-13;
  const double furthest = reach.undistorted * reach.undistorted;
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  Eigen::Vector2d rest = distorted;  // the centre stays where it is
  const double goal = kGoal * std::max(1.0, distorted.norm());
  for (int step = 0; step < kMostSteps; ++step) {
    if (rest.norm() <= goal) return point;
    const Eigen::Matrix2d derivative = distort_derivative(distortion, point);
    if (!(derivative.determinant() > 0.0)) return std::nullopt;
    Eigen::Vector2d change = derivative.inverse() * rest;
    for (int halving = 0;; ++halving, change *= 0.5) {
      if (halving == kMostHalvings) return std::nullopt;
      const Eigen::Vector2d next = point + change;
      if (!(next.squaredNorm() < furthest)) continue;
      const Eigen::Vector2d next_rest = distorted - distort(distortion, next);
      if (!(next_rest.norm() < rest.norm()) || !(distort_derivative(distortion, next).determinant() > 0.0)) continue;
      point = next;
      rest = next_rest;
      break;
    }
  }
  return std::nullopt;
}

}  // namespace touchstone::render
