#include "fem/contact/covered_triangle.h"

namespace touchstone::fem {
namespace {

constexpr double kSplitAboveBody = 1.0;  // a cell larger than this times the body's radius is split

}  // namespace

RadonRule::RadonRule() {
  const double root = std::sqrt(15.0);
  points[0] = Eigen::Vector3d::Constant(1.0 / 3.0);
  weights[0] = 9.0 / 40.0;
  for (int family = 0; family < 2; ++family) {
    const double sign = family == 0 ? -1.0 : 1.0;
    const double a = (6.0 + sign * root) / 21.0;
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d b = Eigen::Vector3d::Constant(a);
      b[k] = 1.0 - 2.0 * a;
      points[1 + 3 * family + k] = b;
      weights[1 + 3 * family + k] = (155.0 + sign * root) / 1200.0;
    }
  }
}

const RadonRule& radon_rule() {
  static const RadonRule rule;
  return rule;
}

int splits_for_body(double area, double body_radius) {
  int splits = 0;
  for (double size = std::sqrt(2.0 * area); size > kSplitAboveBody * body_radius && splits < 6; size *= 0.5) ++splits;
  return splits;
}

}  // namespace touchstone::fem
