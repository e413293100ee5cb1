// The egg and the thin shell: entries against their own equations, walked along the line.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

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
