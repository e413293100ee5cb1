#include "fem/elements/quadrature.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "core/error.h"

namespace touchstone::fem {
namespace {

struct LinePoint {
  double x;  // in [-1, 1]
  double weight;
};

/// Gauss-Legendre with n points on [-1, 1]: Newton's method on the Legendre polynomial from the Chebyshev guess.
std::vector<LinePoint> gauss_legendre(int n) {
  std::vector<LinePoint> points(n);
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
    double slope = 0.0;
    for (int step = 0; step < 50; ++step) {
      double previous = 1.0;
      double value = x;
      for (int k = 2; k <= n; ++k) {
        const double next = ((2 * k - 1) * x * value - (k - 1) * previous) / k;
        previous = value;
        value = next;
      }
      slope = n * (x * value - previous) / (x * x - 1.0);
      const double change = value / slope;
      x -= change;
      if (std::abs(change) < 1e-16) {
        break;
      }
    }
    points[i] = {x, 2.0 / ((1.0 - x * x) * slope * slope)};
  }
  return points;
}

/// On [0, 1], weights summing to one.
std::vector<LinePoint> unit_interval_rule(int n) {
  std::vector<LinePoint> points = gauss_legendre(n);
  for (LinePoint& point : points) {
    point = {0.5 * (1.0 - point.x), 0.5 * point.weight};
  }
  return points;
}

}  // namespace

std::vector<SimplexPoint<4>> tetrahedron_rule(int degree) {
  TS_ASSERT(degree >= 0);
  // The collapse of the cube brings a Jacobian of degree two.
  const std::vector<LinePoint> line = unit_interval_rule((degree + 2) / 2 + 1);
  std::vector<SimplexPoint<4>> rule;
  for (const LinePoint& a : line) {
    for (const LinePoint& b : line) {
      for (const LinePoint& c : line) {
        const double x = a.x;
        const double y = (1.0 - a.x) * b.x;
        const double z = (1.0 - a.x) * (1.0 - b.x) * c.x;
        const double jacobian = (1.0 - a.x) * (1.0 - a.x) * (1.0 - b.x);
        rule.push_back({{1.0 - x - y - z, x, y, z}, 6.0 * jacobian * a.weight * b.weight * c.weight});
      }
    }
  }
  return rule;
}

std::vector<SimplexPoint<3>> triangle_rule(int degree) {
  TS_ASSERT(degree >= 0);
  const std::vector<LinePoint> line = unit_interval_rule((degree + 1) / 2 + 1);
  std::vector<SimplexPoint<3>> rule;
  for (const LinePoint& a : line) {
    for (const LinePoint& b : line) {
      const double x = a.x;
      const double y = (1.0 - a.x) * b.x;
      rule.push_back({{1.0 - x - y, x, y}, 2.0 * (1.0 - a.x) * a.weight * b.weight});
    }
  }
  return rule;
}

std::vector<SpherePoint> sphere_rule(int degree) {
  TS_ASSERT(degree >= 1);
  const std::vector<LinePoint> heights = gauss_legendre(degree / 2 + 1);
  const int around = 4 * (degree / 4 + 1);
  std::vector<SpherePoint> rule;
  for (const LinePoint& height : heights) {
    const double ring = std::sqrt(1.0 - height.x * height.x);
    for (int k = 0; k < around; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / around;
      rule.push_back({{ring * std::cos(angle), ring * std::sin(angle), height.x}, 0.5 * height.weight / around});
    }
  }
  return rule;
}

const std::vector<SimplexPoint<4>>& symmetric_tetrahedron_rule() {
  static const std::vector<SimplexPoint<4>> rule = [] {
    std::vector<SimplexPoint<4>> points;
    for (const auto& [a, weight] : {std::pair{0.31088591926330060980, 0.11268792571801585080},
                                    std::pair{0.09273525031089122640, 0.07349304311636194954}}) {
      for (int k = 0; k < 4; ++k) {
        SimplexPoint<4> point{Eigen::Vector4d::Constant(a), weight};
        point.barycentric[k] = 1.0 - 3.0 * a;
        points.push_back(point);
      }
    }
    constexpr double kEdge = 0.04550370412564964949;
    for (int k = 0; k < 4; ++k) {
      for (int l = k + 1; l < 4; ++l) {
        SimplexPoint<4> point{Eigen::Vector4d::Constant(kEdge), 0.04254602077708146644};
        point.barycentric[k] = point.barycentric[l] = 0.5 - kEdge;
        points.push_back(point);
      }
    }
    return points;
  }();
  return rule;
}

}  // namespace touchstone::fem
