#include "sensors/touch_map/planar_pose.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/random.h"

namespace touchstone::sensors {
namespace {

std::vector<Eigen::Vector2d> scattered(int count, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i) points.emplace_back(10.0 * random.uniform() - 3.0, 8.0 * random.uniform());
  return points;
}

TEST(PlanarPose, ComposesAsItsMapsDo) {
  const PlanarPose a{0.7, {1.0, -2.0}}, b{-2.9, {0.3, 4.0}};
  const Eigen::Vector2d p(2.5, -1.5);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-12);
  EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-12);
  EXPECT_LT(((a * a.inverse()).translation).norm(), 1e-12);
}

TEST(PlanarPose, APositiveAngleTurnsXTowardsY) {
  const PlanarPose quarter{kPi / 2, {0, 0}};
  EXPECT_LT((quarter * Eigen::Vector2d(1, 0) - Eigen::Vector2d(0, 1)).norm(), 1e-12);
}

TEST(PlanarPose, AnglesAreWrappedToTheHalfOpenTurn) {
  EXPECT_NEAR(wrapped(3.0 * kPi), kPi, 1e-12);
  EXPECT_NEAR(wrapped(-kPi), kPi, 1e-12);
  EXPECT_NEAR(wrapped(-0.5 - 6.0 * kPi), -0.5, 1e-12);
}

TEST(PlanarPose, LeastSquaresFindsTheExactIsometryOfAnyAngle) {
  const auto from = scattered(7, 1);
  for (int degrees = -180; degrees <= 180; degrees += 15) {
    const PlanarPose truth{degrees * kRadiansPerDegree, {0.5 * degrees, -3.0}};
    std::vector<Eigen::Vector2d> to;
    for (const auto& point : from) to.push_back(truth * point);
    const PlanarPose found = least_squares_isometry(to, from);
    EXPECT_LT(std::abs(wrapped(found.angle - truth.angle)), 1e-12);
    EXPECT_LT((found.translation - truth.translation).norm(), 1e-11);
    EXPECT_LT((least_squares_linear_part(to, from) - truth.rotation()).norm(), 1e-12);
  }
}

/// No isometry near to the answer has a smaller sum of squares.
TEST(PlanarPose, LeastSquaresIsAMinimum) {
  const auto from = scattered(20, 2);
  RandomStream random(3, 0, Purpose::kTest);
  std::vector<Eigen::Vector2d> to;
  for (const auto& point : from) {
    to.push_back(PlanarPose{1.0, {2, 3}} * point + 0.3 * Eigen::Vector2d(random.normal(), random.normal()));
  }
  const auto squares = [&](const PlanarPose& pose) {
    double sum = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i) sum += (pose * from[i] - to[i]).squaredNorm();
    return sum;
  };
  const PlanarPose best = least_squares_isometry(to, from);
  for (const double step : {-1e-3, 1e-3}) {
    EXPECT_GT(squares({best.angle + step, best.translation}), squares(best));
    EXPECT_GT(squares({best.angle, best.translation + Eigen::Vector2d(step, 0)}), squares(best));
    EXPECT_GT(squares({best.angle, best.translation + Eigen::Vector2d(0, step)}), squares(best));
  }
}

TEST(PlanarPose, ConfidenceFallsByTheChangeOfArea) {
  EXPECT_NEAR(isometry_confidence(PlanarPose{2.0, {}}.rotation()), 1.0, 1e-12);
  EXPECT_NEAR(isometry_confidence(1.1 * Eigen::Matrix2d::Identity()), 1.0 - 0.21, 1e-12);
  EXPECT_NEAR(isometry_confidence(0.9 * Eigen::Matrix2d::Identity()), 0.81, 1e-12);
  EXPECT_EQ(isometry_confidence(2.0 * Eigen::Matrix2d::Identity()), 0.0);
  // A mirrored surface has determinant -1.
  EXPECT_EQ(isometry_confidence(Eigen::Vector2d(1, -1).asDiagonal()), 0.0);
}

TEST(PlanarPose, PointsOnALineGiveNoConfidence) {
  const std::vector<Eigen::Vector2d> line = {{0, 0}, {1, 1}, {2, 2}, {5, 5}};
  EXPECT_EQ(isometry_confidence(least_squares_linear_part(line, line)), 0.0);
  const std::vector<Eigen::Vector2d> two = {{0, 0}, {1, 3}};
  EXPECT_EQ(isometry_confidence(least_squares_linear_part(two, two)), 0.0);
}

}  // namespace
}  // namespace touchstone::sensors
