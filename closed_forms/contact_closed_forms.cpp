#include "closed_forms/contact_closed_forms.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/gauss_rule.h"
#include "core/units.h"

namespace touchstone::closed_forms {
namespace {

double shear_modulus(double youngs_modulus, double poisson_ratio) {
  return youngs_modulus / (2.0 * (1.0 + poisson_ratio));
}

/// int_0^inf (1 - M(q)) cos(q y) dq, y >= 0 in thicknesses.
class KernelTransform {
 public:
  /// 1 - M must be negligible beyond `end`.
  KernelTransform(const std::function<double(double)>& kernel, double end) {
    const GaussRule rule = gauss_rule(12);
    for (double q = 0.0; q < end;) {
      const double panel = std::clamp(q / 40.0, kPanel, 8.0 * kPanel);
      for (int g = 0; g < rule.nodes.size(); ++g) {
        const double at = q + panel * rule.nodes[g];
        points_.emplace_back(at, panel * rule.weights[g] * (1.0 - kernel(at)));
      }
      q += panel;
    }
  }
  explicit KernelTransform(double poisson_ratio)
      : KernelTransform([poisson_ratio](double q) { return bonded_layer_kernel(poisson_ratio, q); }, kEnd) {}
  double operator()(double y) const {
    double sum = 0.0;
    for (const auto& [q, weight] : points_) sum += weight * std::cos(q * y);
    return sum;
  }

  static constexpr double kEnd = 24.0;  // 1 - M falls as q^2 exp(-2q)

 private:
  static constexpr double kPanel = 0.5;
  std::vector<std::pair<double, double>> points_;
};

constexpr int kNodes = 48;

/// The function phi on the nodes of [0, a] for p(r) = int k J0(kr) int_0^a phi(t) cos(kt) dt dk, given the wanted
/// right-hand side F(t): phi(t) - (2/pi) int_0^a phi(s) L(t, s) ds = F(t). Also phi's value at a.
struct Density {
  double integral = 0.0;
  double at_rim = 0.0;
};

Density solve_density(const KernelTransform& transform, double thickness, double radius,
                      const std::function<double(double)>& wanted) {
  static const GaussRule rule = gauss_rule(kNodes);
  const auto kernel = [&](double t, double s) {
    const double half_sum = 0.5 * (transform(std::abs(t - s) / thickness) + transform((t + s) / thickness));
    return 2.0 / kPi * half_sum / thickness;
  };
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(kNodes, kNodes);
  Eigen::VectorXd right(kNodes);
  for (int i = 0; i < kNodes; ++i) {
    const double t = radius * rule.nodes[i];
    right[i] = wanted(t);
    for (int j = 0; j < kNodes; ++j) matrix(i, j) -= radius * rule.weights[j] * kernel(t, radius * rule.nodes[j]);
  }
  const Eigen::VectorXd phi = matrix.partialPivLu().solve(right);
  Density density;
  density.at_rim = wanted(radius);
  for (int j = 0; j < kNodes; ++j) {
    density.integral += radius * rule.weights[j] * phi[j];
    density.at_rim += radius * rule.weights[j] * kernel(radius, radius * rule.nodes[j]) * phi[j];
  }
  return density;
}

double half_space_factor(double youngs_modulus, double poisson_ratio) {
  return 2.0 * (1.0 - poisson_ratio * poisson_ratio) / youngs_modulus;
}

}  // namespace

double hertz_force(double youngs_modulus, double poisson_ratio, double radius, double depth) {
  return 4.0 * youngs_modulus * std::sqrt(radius) * std::pow(depth, 1.5) /
         (3.0 * (1.0 - poisson_ratio * poisson_ratio));
}

double hertz_contact_radius(double radius, double depth) {
  return std::sqrt(radius * depth);
}

double hertz_largest_pressure(double force, double contact_radius) {
  return 1.5 * force / (kPi * contact_radius * contact_radius);
}

double flat_punch_force(double youngs_modulus, double poisson_ratio, double radius, double depth) {
  return 2.0 * youngs_modulus * radius * depth / (1.0 - poisson_ratio * poisson_ratio);
}

double sneddon_sphere_depth(double radius, double contact_radius) {
  return 0.5 * contact_radius * std::log((radius + contact_radius) / (radius - contact_radius));
}

double sneddon_sphere_force(double youngs_modulus, double poisson_ratio, double radius, double contact_radius) {
  const double a = contact_radius;
  return youngs_modulus / (2.0 * (1.0 - poisson_ratio * poisson_ratio)) *
         ((a * a + radius * radius) * std::log((radius + a) / (radius - a)) - 2.0 * a * radius);
}

double mindlin_stick_ratio(double shear, double friction, double force) {
  return std::cbrt(1.0 - shear / (friction * force));
}

double mindlin_displacement(double youngs_modulus, double poisson_ratio, double contact_radius, double shear,
                            double friction, double force) {
  const double ratio = mindlin_stick_ratio(shear, friction, force);
  return 3.0 * friction * force * (2.0 - poisson_ratio) /
         (16.0 * shear_modulus(youngs_modulus, poisson_ratio) * contact_radius) * (1.0 - ratio * ratio);
}

Eigen::Vector3d boussinesq_displacement(double youngs_modulus, double poisson_ratio, double push, double x, double y) {
  const double g = shear_modulus(youngs_modulus, poisson_ratio);
  const double r = std::hypot(x, y);
  const double inward = -(1.0 - 2.0 * poisson_ratio) * push / (4.0 * kPi * g * r);
  return {inward * x / r, inward * y / r, -(1.0 - poisson_ratio) * push / (2.0 * kPi * g * r)};
}

Eigen::Vector3d cerruti_displacement(double youngs_modulus, double poisson_ratio, double shear, double x, double y) {
  const double g = shear_modulus(youngs_modulus, poisson_ratio);
  const double nu = poisson_ratio;
  const double r = std::hypot(x, y);
  const double along = shear / (2.0 * kPi * g * r) * ((1.0 - nu) + nu * x * x / (r * r));
  const double across = nu * shear * x * y / (2.0 * kPi * g * r * r * r);
  // Ahead of the force the surface sinks: the z of [Johnson1985] points into the body, ours out of it.
  return {along, across, -(1.0 - 2.0 * nu) * shear * x / (4.0 * kPi * g * r * r)};
}

double hayes_kappa(double radius_over_thickness) {
  static constexpr std::array<std::pair<double, double>, 4> table{
      {{0.2, 1.20656}, {0.4, 1.47261}, {1.0, 2.48352}, {2.0, 4.35324}}};
  for (const auto& [ratio, kappa] : table) {
    if (std::abs(ratio - radius_over_thickness) < 1e-12) return kappa;
  }
  fail("Hayes' kappa isn't tabulated at a/h = {}; 0.2, 0.4, 1 and 2 are", radius_over_thickness);
}

double gent_lindley_modulus(double youngs_modulus, double radius, double thickness) {
  const double shape = radius / (2.0 * thickness);
  return youngs_modulus * (1.0 + 2.0 * shape * shape);
}

double dimitriadis_force(double youngs_modulus, double radius, double thickness, double depth) {
  const double x = std::sqrt(radius * depth) / thickness;
  const double series = 1.0 + x * (1.133 + x * (1.283 + x * (0.769 + x * 0.0975)));
  return 16.0 / 9.0 * youngs_modulus * std::sqrt(radius) * std::pow(depth, 1.5) * series;
}

double thin_layer_force(double youngs_modulus, double radius, double thickness, double depth) {
  const double a = 2.0 * std::sqrt(radius * depth);
  return kPi * youngs_modulus * std::pow(a, 6) / (96.0 * radius * std::pow(thickness, 3));
}

double bonded_layer_kernel(double poisson_ratio, double q) {
  const double nu = poisson_ratio;
  const double b = 3.0 - 4.0 * nu;
  if (q < 1e-3) {
    // The leading terms of the series: numerator 4 (1 - 2 nu) q + b 4/3 q^3, denominator b + 5 - 12 nu + 8 nu^2 + ...
    const double numerator = (2.0 * b - 2.0) * q + b * 4.0 / 3.0 * q * q * q;
    return numerator / (b + 2.0 * b * q * q + 2.0 * q * q + 5.0 - 12.0 * nu + 8.0 * nu * nu);
  }
  const double e = std::exp(-2.0 * q);
  const double numerator = 0.5 * b * (1.0 - e * e) - 2.0 * q * e;
  const double denominator = 0.5 * b * (1.0 + e * e) + e * (2.0 * q * q + 5.0 - 12.0 * nu + 8.0 * nu * nu);
  return numerator / denominator;
}

LayerContact flat_punch_on_layer(double youngs_modulus, double poisson_ratio, double thickness, double radius,
                                 double depth) {
  const KernelTransform transform(poisson_ratio);
  const double flat = 2.0 * depth / (kPi * half_space_factor(youngs_modulus, poisson_ratio));
  const Density density = solve_density(transform, thickness, radius, [&](double) { return flat; });
  return {2.0 * kPi * density.integral, radius};
}

double layered_kernel(std::span<const ElasticLayer> layers, double wave_number) {
  double total = 0.0;
  for (const ElasticLayer& layer : layers) total += layer.thickness;
  // For long waves the exponentials are nearly dependent; there M is k times a series in k^2.
  constexpr double kLong = 0.02;
  if (wave_number * total < kLong) {
    const double k1 = kLong / total;
    const double k2 = 1.5 * k1;
    const double m1 = layered_kernel(layers, k1) / k1;
    const double m2 = layered_kernel(layers, k2) / k2;
    const double curve = (m2 - m1) / (k2 * k2 - k1 * k1);
    return wave_number * (m1 + curve * (wave_number * wave_number - k1 * k1));
  }
  const double k = wave_number;
  const auto count = static_cast<Eigen::Index>(layers.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(4 * count, 4 * count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(4 * count);
  // Rows u, w (over k^2 / 2G0) and shear, normal stress (over k^3) of a layer's four functions at `height` over its
  // lower face; z in units of 1/k, out of the body. G0 is the outermost layer's.
  const auto shear = [&](Eigen::Index n) { return shear_modulus(layers[n].youngs_modulus, layers[n].poisson_ratio); };
  const auto rows_at = [&](Eigen::Index n, double height) {
    const double nu = layers[n].poisson_ratio;
    const double softness = shear(0) / shear(n);
    const double h = k * layers[n].thickness;
    Eigen::Matrix4d rows;
    for (int column = 0; column < 4; ++column) {
      const double sign = column < 2 ? 1.0 : -1.0;  // grows, or falls, with z
      const double distance = column < 2 ? height - h : height;
      const double e = std::exp(sign * distance);
      const bool linear = column % 2 == 1;
      const double f = (linear ? distance : 1.0) * e;
      const double f1 = linear ? (1.0 + sign * distance) * e : sign * e;
      const double f2 = linear ? (2.0 * sign + distance) * e : e;
      const double f3 = linear ? (3.0 + sign * distance) * e : sign * e;
      rows(0, column) = softness * f1;
      rows(1, column) = softness * ((1.0 - 2.0 * nu) * f2 - 2.0 * (1.0 - nu) * f);
      rows(2, column) = -(nu * f2 + (1.0 - nu) * f);
      rows(3, column) = (1.0 - nu) * f3 - (2.0 - nu) * f1;
    }
    return rows;
  };
  const Eigen::Matrix4d top = rows_at(0, k * layers[0].thickness);
  matrix.block<2, 4>(0, 0) = top.bottomRows<2>();
  right[1] = -1.0;  // a unit pressure
  for (Eigen::Index n = 0; n + 1 < count; ++n) {
    matrix.block<4, 4>(2 + 4 * n, 4 * n) = rows_at(n, 0.0);
    matrix.block<4, 4>(2 + 4 * n, 4 * n + 4) = -rows_at(n + 1, k * layers[n + 1].thickness);
  }
  matrix.block<2, 4>(4 * count - 2, 4 * count - 4) = rows_at(count - 1, 0.0).topRows<2>();
  const Eigen::VectorXd found = matrix.fullPivLu().solve(right);
  // w = (rows) k^2 / (2 G0) for a pressure of k^3: -w / p = (rows) / (2 G0 k), against (1 - nu) / (G0 k).
  return -top.row(1).dot(found.head<4>()) / (2.0 * (1.0 - layers[0].poisson_ratio));
}

namespace {

LayerContact profile_contact(const KernelTransform& transform, double half_space, double thickness,
                             const std::function<double(double)>& slope, double depth, double largest_radius) {
  const double scale = 2.0 / (kPi * half_space);
  static const GaussRule rule = gauss_rule(64);
  // F(t) = scale (d - t int_0^t f'(r) / sqrt(t^2 - r^2) dr), r = t sin(angle).
  const auto wanted = [&](double t) {
    double sum = 0.0;
    for (int g = 0; g < rule.nodes.size(); ++g) {
      sum += rule.weights[g] * slope(t * std::sin(0.5 * kPi * rule.nodes[g]));
    }
    return scale * (depth - 0.5 * kPi * t * sum);
  };
  const auto rim = [&](double radius) { return solve_density(transform, thickness, radius, wanted); };
  // Illinois' false position: the rim's density is positive inside and negative outside.
  double inside = 1e-6 * largest_radius;
  double outside = largest_radius;
  double low = rim(inside).at_rim;
  double high = rim(outside).at_rim;
  if (!(low > 0.0) || !(high < 0.0)) fail("the contact radius isn't below {} mm", largest_radius);
  int side = 0;
  Density last;
  double radius = inside;
  for (int k = 0; k < 60; ++k) {
    radius = (inside * high - outside * low) / (high - low);
    last = rim(radius);
    if (std::abs(last.at_rim) < 1e-11 * scale * depth || outside - inside < 1e-12 * largest_radius) break;
    if (last.at_rim > 0.0) {
      inside = radius;
      low = last.at_rim;
      if (side == 1) high *= 0.5;
      side = 1;
    } else {
      outside = radius;
      high = last.at_rim;
      if (side == -1) low *= 0.5;
      side = -1;
    }
  }
  return {2.0 * kPi * last.integral, radius};
}

}  // namespace

LayerContact profile_on_layer(double youngs_modulus, double poisson_ratio, double thickness,
                              const std::function<double(double)>& slope, double depth, double largest_radius) {
  return profile_contact(KernelTransform(poisson_ratio), half_space_factor(youngs_modulus, poisson_ratio), thickness,
                         slope, depth, largest_radius);
}

LayerContact sphere_on_layer(double youngs_modulus, double poisson_ratio, double thickness, double radius,
                             double depth) {
  return profile_on_layer(
      youngs_modulus, poisson_ratio, thickness,
      [&](double r) { return r / std::sqrt(std::max(1e-300, radius * radius - r * r)); }, depth, 0.999 * radius);
}

LayerContact sphere_on_layers(std::span<const ElasticLayer> layers, double radius, double depth) {
  double total = 0.0;
  const double outermost = layers[0].thickness;
  for (const ElasticLayer& layer : layers) total += layer.thickness;
  const KernelTransform transform([&](double q) { return layered_kernel(layers, q / total); },
                                  KernelTransform::kEnd * total / outermost);
  return profile_contact(
      transform, half_space_factor(layers[0].youngs_modulus, layers[0].poisson_ratio), total,
      [&](double r) { return r / std::sqrt(std::max(1e-300, radius * radius - r * r)); }, depth, 0.999 * radius);
}

}  // namespace touchstone::closed_forms
