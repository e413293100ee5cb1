#include "fem/elements/quadrature.h"

#include <gtest/gtest.h>

#include <cmath>

namespace touchstone::fem {
namespace {

double factorial(int n) {
  return std::tgamma(n + 1.0);
}

TEST(Quadrature, TetrahedronRuleIsExactUpToItsDegree) {
  for (int degree = 0; degree <= 8; ++degree) {
    const auto rule = tetrahedron_rule(degree);
    for (int a = 0; a <= degree; ++a) {
      for (int b = 0; a + b <= degree; ++b) {
        const int c = degree - a - b;
        double mean = 0.0;
        for (const auto& point : rule) {
          mean += point.weight * std::pow(point.barycentric[1], a) * std::pow(point.barycentric[2], b) *
                  std::pow(point.barycentric[3], c);
        }
        const double exact = 6.0 * factorial(a) * factorial(b) * factorial(c) / factorial(degree + 3);
        EXPECT_NEAR(mean, exact, 1e-14) << degree << ": " << a << ' ' << b << ' ' << c;
      }
    }
  }
}

TEST(Quadrature, SymmetricTetrahedronRuleIsExactUpToDegreeFive) {
  for (int a = 0; a <= 5; ++a) {
    for (int b = 0; a + b <= 5; ++b) {
      for (int c = 0; a + b + c <= 5; ++c) {
        double mean = 0.0;
        for (const auto& point : symmetric_tetrahedron_rule()) {
          mean += point.weight * std::pow(point.barycentric[1], a) * std::pow(point.barycentric[2], b) *
                  std::pow(point.barycentric[3], c);
        }
        const double exact = 6.0 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3);
        EXPECT_NEAR(mean, exact, 1e-15) << a << ' ' << b << ' ' << c;
      }
    }
  }
}

TEST(Quadrature, TriangleRuleIsExactUpToItsDegree) {
  for (int degree = 0; degree <= 8; ++degree) {
    for (int a = 0; a <= degree; ++a) {
      const int b = degree - a;
      double mean = 0.0;
      for (const auto& point : triangle_rule(degree)) {
        mean += point.weight * std::pow(point.barycentric[0], a) * std::pow(point.barycentric[2], b);
      }
      EXPECT_NEAR(mean, 2.0 * factorial(a) * factorial(b) / factorial(degree + 2), 1e-14) << a << ' ' << b;
    }
  }
}

/// Mean of x^a y^b z^c over the unit sphere, all even [Folland2001].
TEST(Quadrature, SphereRuleIsExactUpToItsDegree) {
  for (const int degree : {2, 5, 8, 16}) {
    const auto rule = sphere_rule(degree);
    for (int a = 0; a <= degree; ++a) {
      for (int b = 0; a + b <= degree; ++b) {
        for (int c = 0; a + b + c <= degree; ++c) {
          double mean = 0.0;
          for (const auto& point : rule) {
            mean += point.weight * std::pow(point.direction.x(), a) * std::pow(point.direction.y(), b) *
                    std::pow(point.direction.z(), c);
          }
          const bool even = a % 2 == 0 && b % 2 == 0 && c % 2 == 0;
          const double exact = !even ? 0.0
                                     : std::tgamma((a + 1) / 2.0) * std::tgamma((b + 1) / 2.0) *
                                           std::tgamma((c + 1) / 2.0) * std::tgamma(1.5) /
                                           (std::pow(std::tgamma(0.5), 3) * std::tgamma((a + b + c + 3) / 2.0));
          EXPECT_NEAR(mean, exact, 1e-14) << degree << ": " << a << ' ' << b << ' ' << c;
        }
      }
    }
  }
}

}  // namespace
}  // namespace touchstone::fem
