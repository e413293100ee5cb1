#include "fem/shapes/relief_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/error.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

/// (1 - cos) / 2 along x, one period of `period`, everywhere.
std::shared_ptr<const ReliefMap> waves(double period, double amplitude) {
  constexpr int kPoints = 128;
  std::vector<float> heights;
  for (int i = 0; i < kPoints; ++i) {
    heights.push_back(static_cast<float>(0.5 * amplitude * (1.0 - std::cos(2.0 * kPi * i / kPoints))));
  }
  return std::make_shared<const ReliefMap>(kPoints, 1, Eigen::Vector2d(0, 0), Eigen::Vector2d(period / kPoints, 1.0),
                                           std::array{true, true}, heights);
}

TEST(ReliefMap, IsBilinearInsideAndZeroOutside) {
  const ReliefMap map(2, 2, {1.0, 2.0}, {0.5, 0.25}, {false, false}, {1, 2, 3, 4});
  EXPECT_DOUBLE_EQ(map.at(1.0, 2.0), 1.0);
  EXPECT_DOUBLE_EQ(map.at(1.5, 2.25), 4.0);
  EXPECT_DOUBLE_EQ(map.at(1.25, 2.125), 2.5);
  EXPECT_DOUBLE_EQ(map.at(0.75, 2.0), 0.5) << "it falls to zero over one spacing";
  EXPECT_DOUBLE_EQ(map.at(0.4, 2.0), 0.0);
  EXPECT_DOUBLE_EQ(map.at(1e12, -1e12), 0.0);
  EXPECT_DOUBLE_EQ(map.highest(), 4.0);
}

TEST(ReliefMap, RepeatsWithoutASeam) {
  const auto map = waves(0.7, 0.02);
  for (const double x : {-0.701, -0.35, 0.0, 0.2, 0.6999, 5.2}) {
    EXPECT_NEAR(map->at(x, 123.4), 0.01 * (1.0 - std::cos(2.0 * kPi * x / 0.7)), 5e-6) << x;
    EXPECT_NEAR(map->at(x, 0.0), map->at(x + 7.0, -3.0), 1e-8);
  }
}

TEST(ReliefMap, BlurredFarWiderThanItsPeriodOnlyItsMeanIsLeft) {
  const ReliefMap map = waves(0.1, 0.02)->blurred(0.5);
  for (const double x : {0.0, 0.02, 0.05, 0.09}) EXPECT_NEAR(map.at(x, 0.0), 0.01, 2e-5);
}

// A triangular window of half width w takes a wave of number k down by (sin(kw/2)/(kw/2))^2.
TEST(ReliefMap, BlurredWavesFallAsTheWindowSays) {
  const double period = 2.0;
  const double half = kPi / period * 0.5;
  const double left = std::pow(std::sin(half) / half, 2);
  const ReliefMap map = waves(period, 0.02)->blurred(0.5);
  EXPECT_NEAR(map.at(1.0, 0.0) - map.at(0.0, 0.0), 0.02 * left, 1e-4 * 0.02);
}

TEST(ReliefMap, BlurringKeepsTheVolume) {
  std::vector<float> heights(21 * 11, 0.0F);
  heights[5 * 21 + 10] = 0.3F;
  const ReliefMap map(21, 11, {-1.0, -0.5}, {0.1, 0.1}, {false, false}, heights);
  const ReliefMap blurred = map.blurred(0.3);
  double volume = 0.0;
  for (double y = -1.5; y < 1.5; y += 0.01) {
    for (double x = -2.0; x < 2.0; x += 0.01) volume += blurred.at(x, y) * 1e-4;
  }
  EXPECT_NEAR(volume, 0.3 * 0.01, 0.02 * 0.003);
  EXPECT_LT(blurred.highest(), 0.1);
}

TEST(ReliefMap, RefusesWhatIsntAHeight) {
  const auto error_of = [](int nx, double spacing, float height) {
    try {
      ReliefMap(nx, 1, {0, 0}, {spacing, 1.0}, {false, false}, {height});
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(error_of(1, 1.0, 0.5F), "");
  EXPECT_THAT(error_of(0, 1.0, 0.5F), HasSubstr("0 x 1"));
  EXPECT_THAT(error_of(2, 1.0, 0.5F), HasSubstr("given 1"));
  EXPECT_THAT(error_of(1, 0.0, 0.5F), HasSubstr("above 0"));
  EXPECT_THAT(error_of(1, 1.0, -0.5F), HasSubstr("at least 0"));
  EXPECT_THAT(error_of(1, 1.0, std::nanf("")), HasSubstr("nan"));
}

TEST(ReliefShape, StandsLowerThanThePlainBodyByItsHeight) {
  const ReliefShape shape{BoxShape{{4.0, 4.0, 2.0}}, waves(0.5, 0.02)};
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  for (const double x : {-1.9, -0.3, 0.0, 0.11, 0.25, 1.7}) {
    const auto t = first_entry(shape, {x, 0.3, -3.0}, up);
    ASSERT_TRUE(t);
    EXPECT_NEAR(*t, 2.0 - shape.relief->at(x, 0.3), 1e-12) << x;
  }
  EXPECT_FALSE(first_entry(shape, {2.1, 0.0, -3.0}, up)) << "no relief beside the body";
  EXPECT_NEAR(*first_entry(shape, {0.25, 0.0, 3.0}, -up), 2.0, 1e-12) << "its back is plain";
}

TEST(ReliefShape, ATiltedLineEndsOnTheRelief) {
  const ReliefShape shape{BoxShape{{4.0, 4.0, 2.0}}, waves(0.5, 0.02)};
  const Eigen::Vector3d direction = Eigen::Vector3d(0.3, -0.1, 1.0).normalized();
  for (double x = -1.0; x < 1.0; x += 0.037) {
    const Eigen::Vector3d point(x, 0.1, -1.5);
    const auto t = first_entry(shape, point, direction);
    ASSERT_TRUE(t);
    const Eigen::Vector3d at = point + *t * direction;
    EXPECT_NEAR(at.z(), -1.0 - shape.relief->at(at.x(), at.y()), 1e-9);
  }
}

TEST(ReliefShape, ItsBallHoldsItAndItsBaseIsChecked) {
  const ContactShape shape = ReliefShape{SphereShape{2.0}, waves(0.5, 0.02)};
  EXPECT_NEAR(bounding_ball(shape).radius, 2.02, 1e-6);
  EXPECT_NO_THROW(check_shape(shape));
  EXPECT_THROW(check_shape(ReliefShape{SphereShape{-2.0}, waves(0.5, 0.02)}), Error);
}

}  // namespace
}  // namespace touchstone::fem
