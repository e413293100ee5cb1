#include "sensors/touch_map/isometry_ransac.h"

#include <gtest/gtest.h>

#include <set>

#include "core/random.h"

namespace touchstone::sensors {
namespace {

constexpr double kNoise = 0.03;  // mm, of each coordinate

/// `good` pairs under `truth` with noise, and `bad` ones at random, in a touch of 16 x 12 mm.
std::vector<PointPair> pairs_of(const PlanarPose& truth, int good, int bad, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  const auto point = [&] { return Eigen::Vector2d(16.0 * random.uniform() - 8.0, 12.0 * random.uniform() - 6.0); };
  std::vector<PointPair> pairs;
  for (int i = 0; i < good + bad; ++i) {
    const Eigen::Vector2d from = point();
    const Eigen::Vector2d noise(random.normal(), random.normal());
    pairs.push_back({from, i < good ? truth * from + kNoise * noise : truth * point(), i, i});
  }
  return pairs;
}

TEST(IsometryRansac, FindsEveryTurnAmongFourOutliersToOne) {
  for (int degrees = -180; degrees <= 170; degrees += 10) {
    const PlanarPose truth{degrees * kRadiansPerDegree, {3.0, -2.0}};
    const auto found = ransac_isometry(pairs_of(truth, 40, 160, static_cast<std::uint64_t>(degrees + 180)), {});
    ASSERT_TRUE(found);
    // The standard deviation of the angle is noise / (sqrt(40) 5.8 mm), that of the place sqrt(2 / 40) noise.
    EXPECT_LT(std::abs(wrapped(found->to_from_from.angle - truth.angle)), 5 * kNoise / (std::sqrt(40.0) * 5.8));
    EXPECT_LT((found->to_from_from.translation - truth.translation).norm(), 5 * kNoise * std::sqrt(2.0 / 40.0));
    EXPECT_GE(found->inliers.size(), 40u);
    EXPECT_LE(found->inliers.size(), 44u);
  }
}

TEST(IsometryRansac, TheSameSeedGivesTheSameAnswer) {
  const auto pairs = pairs_of({1.0, {1, 1}}, 10, 90, 5);
  const auto a = ransac_isometry(pairs, {}), b = ransac_isometry(pairs, {});
  EXPECT_EQ(a->to_from_from.angle, b->to_from_from.angle);
  EXPECT_EQ(a->inliers, b->inliers);
}

TEST(IsometryRansac, APointCountsOnce) {
  // One point that looks like twenty others, all near to each other, isn't twenty inliers.
  std::vector<PointPair> pairs = pairs_of({0.0, {0, 0}}, 10, 0, 6);
  for (int i = 0; i < 20; ++i) pairs.push_back({{1, 1}, {1.0 + 0.001 * i, 1.0}, 10, 10 + i});
  const auto found = ransac_isometry(pairs, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->inliers.size(), 11u);
  std::set<int> points;
  for (const int i : found->inliers) EXPECT_TRUE(points.insert(pairs[i].from_id).second);
}

TEST(IsometryRansac, ASecondPoseIsFoundElsewhereOnly) {
  const PlanarPose first{0.2, {0, 0}}, second{0.2, {2.0, 0}};
  auto pairs = pairs_of(first, 30, 0, 7);
  for (PointPair pair : pairs_of(second, 20, 0, 8)) {
    pair.from_id += 30, pair.to_id += 30;
    pairs.push_back(pair);
  }
  const auto best = ransac_isometry(pairs, {});
  ASSERT_TRUE(best);
  EXPECT_LT((best->to_from_from.translation - first.translation).norm(), 0.05);
  const PoseNeighbourhood here{best->to_from_from, {0, 0}, 0.5, 0.1};
  const auto other = ransac_isometry(pairs, {}, std::span(&here, 1));
  ASSERT_TRUE(other);
  EXPECT_FALSE(here.holds(other->to_from_from));
  EXPECT_LT((other->to_from_from.translation - second.translation).norm(), 0.05);
}

TEST(IsometryRansac, TooFewPairsGiveNothing) {
  EXPECT_FALSE(ransac_isometry({}, {}));
  EXPECT_FALSE(ransac_isometry(pairs_of({}, 1, 0, 1), {}));
  // Two pairs whose distances don't agree.
  const std::vector<PointPair> stretched = {{{0, 0}, {0, 0}, 0, 0}, {{4, 0}, {5, 0}, 1, 1}};
  EXPECT_FALSE(ransac_isometry(stretched, {}));
}

}  // namespace
}  // namespace touchstone::sensors
