// Shapes that are equations (egg, thin shell, cone, torus, bar): entries against these, walked along the line.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {
namespace {

Eigen::Vector3d random_direction(RandomStream& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

/// Below zero inside, zero on the surface.
double outside(const EggShape& egg, const Eigen::Vector3d& q) {
  const double half = q.y() < 0.0 ? egg.blunt : egg.sharp;
  return std::hypot(q.x() / egg.radius, q.y() / half, q.z() / egg.radius) - 1.0;
}

double outside(const ShellShape& shell, const Eigen::Vector3d& q) {
  const double beside = std::hypot(2.0 * q.x() / shell.size.x(), 2.0 * q.y() / shell.size.y()) - 1.0;
  const double above = q.z() - shell.lower_face(q.x(), q.y());
  return std::max({beside, -above, above - shell.thickness});
}

double outside(const ConeShape& cone, const Eigen::Vector3d& q) {
  const double rho = std::hypot(q.x(), q.y());
  const double beside = rho * std::cos(cone.half_angle) - (q.z() - cone.apex()) * std::sin(cone.half_angle);
  const double side = std::max(beside, cone.tip_height() - q.z());
  const double tip = std::hypot(rho, q.z() - cone.tip_radius) - cone.tip_radius;
  return std::max(q.z() - cone.height, cone.tip_radius > 0.0 ? std::min(side, tip) : side);
}

double outside(const TorusShape& torus, const Eigen::Vector3d& q) {
  return std::hypot(std::hypot(q.x(), q.y()) - torus.radius, q.z()) - torus.tube;
}

double outside(const BarShape& bar, const Eigen::Vector3d& q) {
  const double along = std::abs(q.x()) - bar.half_cylinder();
  if (bar.round_ends) return std::hypot(std::max(0.0, along), q.y(), q.z()) - bar.radius;
  return std::max(along, std::hypot(q.y(), q.z()) - bar.radius);
}

/// Entries lie on the surface, nothing before them is inside, and lines that miss have no point inside.
template <typename Shape>
void expect_first_entries(const Shape& shape, double spread, int least_hits) {
  RandomStream random(11, 0, Purpose::kTest);
  const double reach = 2.0 * bounding_ball(shape).radius;
  int hits = 0;
  for (int k = 0; k < 400; ++k) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d p = spread * Eigen::Vector3d(random.normal(), random.normal(), 0.2 * random.normal());
    const Eigen::Vector3d middle = p - p.dot(d) * d;
    const auto t = first_entry(shape, middle, d);
    hits += t.has_value();
    if (t) {
      EXPECT_NEAR(outside(shape, middle + *t * d), 0.0, 1e-11);
    }
    const double end = t.value_or(reach);
    for (int step = 0; step < 500; ++step) {
      const double before = -reach + (end + reach) * step / 500;
      ASSERT_GT(outside(shape, middle + before * d), 0.0);
    }
  }
  EXPECT_GT(hits, least_hits);
  EXPECT_LT(hits, 400);
}

TEST(EggShape, IsEnteredWhereItsEquationSays) {
  expect_first_entries(EggShape{22.0, 25.0, 32.0}, 15.0, 200);
  expect_first_entries(EggShape{3.0, 0.5, 1.0}, 1.5, 200);  // flatter than a ball
}

TEST(EggShape, WithEqualHalvesIsABall) {
  RandomStream random(12, 0, Purpose::kTest);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d p = Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const auto egg = first_entry(EggShape{2.0, 2.0, 2.0}, p, d);
    const auto ball = first_entry(SphereShape{2.0}, p, d);
    ASSERT_EQ(egg.has_value(), ball.has_value());
    if (egg) {
      EXPECT_NEAR(*egg, *ball, 1e-12);
    }
  }
}

TEST(EggShape, HasNoEdgeAtItsEquator) {
  const EggShape egg{22.0, 25.0, 32.0};
  const auto height = [&](double y) { return *first_entry(egg, {3.0, y, -50.0}, Eigen::Vector3d::UnitZ()); };
  const double step = 1e-4;
  EXPECT_NEAR((height(step) - height(0.0)) / step, 0.0, 1e-5);
  EXPECT_NEAR((height(0.0) - height(-step)) / step, 0.0, 1e-5);
}

TEST(ShellShape, IsEnteredWhereItsEquationSays) {
  expect_first_entries(ShellShape{{60.0, 40.0}, 1.7, {1.0 / 60.0, -1.0 / 45.0}}, 12.0, 200);
  expect_first_entries(ShellShape{{6.0, 4.0}, 0.3, {0.5, 0.5}}, 1.2, 150);
  expect_first_entries(ShellShape{{6.0, 4.0}, 0.3, {0.0, 0.0}}, 1.2, 100);
}

TEST(ShellShape, FromBelowIsItsLowerFaceExactly) {
  const ShellShape chip{{60.0, 40.0}, 1.7, {1.0 / 60.0, -1.0 / 45.0}};
  for (const double x : {-20.0, 0.0, 7.0}) {
    for (const double y : {-10.0, 0.0, 14.0}) {
      EXPECT_NEAR(*first_entry(chip, {x, y, -9.0}, Eigen::Vector3d::UnitZ()) - 9.0, chip.lower_face(x, y), 1e-12);
      EXPECT_NEAR(9.0 - *first_entry(chip, {x, y, 9.0}, -Eigen::Vector3d::UnitZ()), chip.lower_face(x, y) + 1.7, 1e-12);
    }
  }
}

// What the gap's integration relies on: a line is never nearer to the outline than said, and the sign is the hit's.
TEST(ShellShape, ItsSilhouetteIsNeverFartherThanTheEllipse) {
  const ShellShape shell{{6.0, 4.0}, 0.3, {0.1, -0.2}};
  RandomStream random(13, 0, Purpose::kTest);
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector3d p(2.5 * random.normal(), 2.0 * random.normal(), 0.0);
    const double said = *silhouette_distance(shell, p, Eigen::Vector3d::UnitZ());
    EXPECT_EQ(said >= 0.0, first_entry(shell, p, Eigen::Vector3d::UnitZ()).has_value());
    double distance = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 2000; ++i) {
      const double angle = 2.0 * kPi * i / 2000;
      distance = std::min(distance, std::hypot(p.x() - 3.0 * std::cos(angle), p.y() - 2.0 * std::sin(angle)));
    }
    EXPECT_LE(std::abs(said), distance + 1e-12);
  }
}

TEST(ConeShape, IsEnteredWhereItsEquationSays) {
  expect_first_entries(ConeShape{0.5, 4.0, 0.0}, 1.0, 60);
  expect_first_entries(ConeShape{0.5, 4.0, 0.8}, 1.0, 60);
  expect_first_entries(ConeShape{1.4, 1.0, 0.0}, 2.5, 100);  // flat
  expect_first_entries(ConeShape{1.4, 1.0, 5.0}, 2.5, 100);
  expect_first_entries(ConeShape{0.1, 6.0, 0.2}, 0.8, 50);   // a needle
  expect_first_entries(ConeShape{0.3, 1.0, 0.9}, 0.4, 100);  // its base cuts the tip's ball, which is wider
}

TEST(ConeShape, FromBelowIsItsProfile) {
  const ConeShape cone{0.6, 5.0, 0.7};
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const double end = 0.7 * std::cos(0.6);  // of the ball
  for (double rho = 0.0; rho < cone.base_radius(); rho += 0.05) {
    const double wanted =
        rho < end ? 0.7 - std::sqrt(0.49 - rho * rho) : (rho - end) / std::tan(0.6) + cone.tip_height();
    EXPECT_NEAR(*first_entry(cone, {0.6 * rho, -0.8 * rho, -3.0}, up) - 3.0, wanted, 1e-12) << rho;
    const ConeShape sharp{0.6, 5.0, 0.0};
    if (rho < sharp.base_radius()) {
      EXPECT_NEAR(*first_entry(sharp, {0.0, rho, -3.0}, up) - 3.0, rho / std::tan(0.6), 1e-12) << rho;
    }
  }
  EXPECT_FALSE(first_entry(cone, {cone.base_radius() + 1e-9, 0.0, 0.0}, up));
  EXPECT_NEAR(*first_entry(cone, {0.0, 0.0, 9.0}, -up), 4.0, 1e-12);  // from above: the base
}

// Lines along the side: the equation's leading coefficient is nothing but rounding.
TEST(ConeShape, LinesAlongItsSideAreEnteredOnce) {
  const ConeShape cone{0.5, 4.0, 0.0};
  const Eigen::Vector3d side(std::sin(0.5), 0.0, std::cos(0.5));
  const Eigen::Vector3d inwards(-std::cos(0.5), 0.0, std::sin(0.5));
  for (const double in : {1e-9, 1e-6, 1e-3, 0.1}) {
    for (const double tilt : {0.0, 1e-17, -1e-16, 1e-12, -1e-9}) {
      const Eigen::Vector3d d = (side + tilt * inwards).normalized();
      const Eigen::Vector3d p = in * inwards + 2.0 * side;
      const auto t = first_entry(cone, p, d);
      ASSERT_TRUE(t.has_value()) << in << ' ' << tilt;
      EXPECT_NEAR(outside(cone, p + *t * d), 0.0, 1e-11) << in << ' ' << tilt;
      EXPECT_LT(*t, 0.0);
    }
  }
}

TEST(TorusShape, IsEnteredWhereItsEquationSays) {
  expect_first_entries(TorusShape{3.0, 0.5}, 1.5, 80);
  expect_first_entries(TorusShape{1.0, 0.95}, 0.7, 150);
  expect_first_entries(TorusShape{10.0, 0.05}, 4.0, 0);  // a wire
}

TEST(TorusShape, FromBelowIsItsTubeAllRound) {
  const TorusShape torus{3.0, 0.5};
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  for (double angle = 0.0; angle < 6.3; angle += 0.3) {
    for (const double out : {-0.5, -0.3, 0.0, 0.2, 0.49}) {
      const double rho = 3.0 + out;
      const Eigen::Vector3d below(rho * std::cos(angle), rho * std::sin(angle), -4.0);
      const auto t = first_entry(torus, below, up);
      ASSERT_TRUE(t.has_value() || std::abs(out) == 0.5);  // to rounding at the rim
      if (t) {
        EXPECT_NEAR(*t - 4.0, -std::sqrt(0.25 - out * out), 1e-7);
      }
    }
  }
  EXPECT_FALSE(first_entry(torus, {0.0, 0.0, 0.0}, up));
  EXPECT_FALSE(first_entry(torus, {0.0, 3.5 + 1e-9, 0.0}, up));
  // Along x the near side's outer face, then, where the hole is in the way, the far side's inner one.
  EXPECT_NEAR(*first_entry(torus, {0.0, 0.0, 0.0}, Eigen::Vector3d::UnitX()), -3.5, 1e-12);
  EXPECT_NEAR(*first_entry(torus, {0.0, 0.0, 0.3}, Eigen::Vector3d::UnitX()), -3.4, 1e-12);
  const Eigen::Vector3d slant = Eigen::Vector3d(1.0, 0.0, 0.25).normalized();
  const auto behind = first_entry(torus, {0.0, 0.0, -0.4}, slant);  // below the near side, into the far one
  ASSERT_TRUE(behind.has_value());
  EXPECT_GT(*behind * slant.x(), 2.0);
}

TEST(BarShape, IsEnteredWhereItsEquationSays) {
  expect_first_entries(BarShape{1.0, 6.0, false}, 1.2, 150);
  expect_first_entries(BarShape{1.0, 6.0, true}, 1.2, 150);
  expect_first_entries(BarShape{1.0, 2.0, true}, 0.8, 100);   // a ball
  expect_first_entries(BarShape{2.0, 0.3, false}, 0.8, 100);  // a coin on its rim
}

TEST(BarShape, ACapsuleIsTwoBallsAndACylinder) {
  RandomStream random(14, 0, Purpose::kTest);
  const BarShape capsule{0.8, 5.0, true};
  const BarShape cylinder{0.8, 5.0 - 1.6, false};
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d p = Eigen::Vector3d(2.0 * random.normal(), random.normal(), random.normal());
    std::optional<double> wanted = first_entry(cylinder, p, d);
    for (const double end : {-1.7, 1.7}) {
      const auto ball = first_entry(SphereShape{0.8}, p - Eigen::Vector3d(end, 0.0, 0.0), d);
      if (ball && (!wanted || *ball < *wanted)) wanted = ball;
    }
    const auto t = first_entry(capsule, p, d);
    ASSERT_EQ(t.has_value(), wanted.has_value());
    if (t) {
      EXPECT_NEAR(*t, *wanted, 1e-12);
    }
  }
}

/// Whatever says how far a line is within the outline: the sign is the hit's, and the outline isn't nearer than said.
/// The outline is looked for along lines across.
template <typename Shape>
void expect_silhouette(const Shape& shape, double spread, const Eigen::Vector3d& d, bool exact) {
  RandomStream random(15, 0, Purpose::kTest);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d p = spread * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const auto said = silhouette_distance(shape, p, d);
    ASSERT_TRUE(said.has_value());
    if (std::abs(*said) < 1e-9) continue;
    const bool hit = first_entry(shape, p, d).has_value();
    ASSERT_EQ(*said > 0.0, hit);
    const Eigen::Vector3d across = d.unitOrthogonal();
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 90; ++i) {
      const Eigen::Vector3d out = Eigen::AngleAxisd(2.0 * kPi * i / 90, d) * across;
      // Nothing changes within what was said.
      EXPECT_EQ(first_entry(shape, p + 0.999 * std::abs(*said) * out, d).has_value(), hit);
      nearest = first_entry(shape, p + 1.02 * std::abs(*said) * out, d).has_value() != hit ? 0.0 : nearest;
    }
    if (exact) {
      EXPECT_EQ(nearest, 0.0) << *said;
    }
  }
}

TEST(SilhouetteDistance, OfConesToriAndBarsIsNeverMoreThanTheOutlineIsAway) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  RandomStream random(16, 0, Purpose::kTest);
  expect_silhouette(ConeShape{0.5, 4.0, 0.8}, 1.5, z, true);
  expect_silhouette(TorusShape{3.0, 0.5}, 2.0, z, true);
  expect_silhouette(BarShape{1.0, 6.0, false}, 2.0, z, false);
  expect_silhouette(BarShape{1.0, 6.0, false}, 1.0, Eigen::Vector3d::UnitX(), true);
  expect_silhouette(BarShape{1.0, 6.0, false}, 2.0, Eigen::Vector3d(0.0, 0.6, 0.8), false);
  for (int k = 0; k < 10; ++k) expect_silhouette(BarShape{1.0, 6.0, true}, 1.5, random_direction(random), true);
  expect_silhouette(BarShape{1.0, 6.0, true}, 1.0, Eigen::Vector3d::UnitX(), true);
}

TEST(CheckShape, RefusesImpossibleConesToriAndBars) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(check_shape(ConeShape{0.0, 1.0, 0.0}), Error);
  EXPECT_THROW(check_shape(ConeShape{0.5 * kPi, 1.0, 0.0}), Error);
  EXPECT_THROW(check_shape(ConeShape{0.5, 0.0, 0.0}), Error);
  EXPECT_THROW(check_shape(ConeShape{0.5, 1.0, -0.1}), Error);
  EXPECT_THROW(check_shape(ConeShape{0.5, 1.0, nan}), Error);
  EXPECT_THROW(check_shape(ConeShape{0.5, 1.0, 1.001 / (1.0 - std::sin(0.5))}), Error);
  EXPECT_NO_THROW(check_shape(ConeShape{0.5, 1.0, 0.999 / (1.0 - std::sin(0.5))}));
  EXPECT_THROW(check_shape(TorusShape{1.0, 1.0}), Error);
  EXPECT_THROW(check_shape(TorusShape{1.0, 0.0}), Error);
  EXPECT_THROW(check_shape(TorusShape{nan, 0.5}), Error);
  EXPECT_NO_THROW(check_shape(TorusShape{1.0, 0.99}));
  EXPECT_THROW(check_shape(BarShape{1.0, 1.9, true}), Error);
  EXPECT_THROW(check_shape(BarShape{0.0, 1.0, false}), Error);
  EXPECT_THROW(check_shape(BarShape{1.0, nan, false}), Error);
  EXPECT_NO_THROW(check_shape(BarShape{1.0, 2.0, true}));
  EXPECT_NO_THROW(check_shape(BarShape{1.0, 0.1, false}));
}

TEST(CheckShape, RefusesImpossibleEggsAndShells) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(check_shape(EggShape{0.0, 1.0, 1.0}), Error);
  EXPECT_THROW(check_shape(EggShape{1.0, -1.0, 1.0}), Error);
  EXPECT_THROW(check_shape(EggShape{1.0, 1.0, nan}), Error);
  EXPECT_NO_THROW(check_shape(EggShape{1.0, 1.0, 1.0}));
  EXPECT_THROW(check_shape(ShellShape{{1.0, 0.0}, 1.0, {0.0, 0.0}}), Error);
  EXPECT_THROW(check_shape(ShellShape{{1.0, 1.0}, 0.0, {0.0, 0.0}}), Error);
  EXPECT_THROW(check_shape(ShellShape{{1.0, 1.0}, 1.0, {nan, 0.0}}), Error);
  EXPECT_NO_THROW(check_shape(ShellShape{{1.0, 1.0}, 1.0, {0.1, -0.1}}));
}

}  // namespace
}  // namespace touchstone::fem
