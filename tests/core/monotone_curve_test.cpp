#include "core/monotone_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/message_of.h"

namespace touchstone {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

using Points = std::vector<Eigen::Vector2d>;

// The answers are those of SciPy 1.10's PchipInterpolator, which has the same slopes.
TEST(MonotoneCurve, IsWhatSciPysPchipInterpolatorGives) {
  const MonotoneCurve rising(Points{{0, 0}, {0.1, 0.3}, {0.25, 0.5}, {0.6, 0.8}, {1, 1}});
  EXPECT_NEAR(rising.at(0.02), 0.07207017543859646, 1e-12);
  EXPECT_NEAR(rising.at(0.05), 0.17214912280701755, 1e-12);
  EXPECT_NEAR(rising.at(0.2), 0.4453201827121701, 1e-12);
  EXPECT_NEAR(rising.at(0.4), 0.6473732520726841, 1e-12);
  EXPECT_NEAR(rising.at(0.75), 0.8896238182773111, 1e-12);
  EXPECT_NEAR(rising.at(0.95), 0.9830315563725491, 1e-12);
  const MonotoneCurve bent(Points{{0, 1}, {0.3, 0.9}, {0.5, 0.95}, {0.8, 0.95}, {1, 0.4}});
  EXPECT_NEAR(bent.at(0.1), 0.9437037037037037, 1e-12);
  EXPECT_NEAR(bent.at(0.29), 0.9001057407407408, 1e-12);
  EXPECT_NEAR(bent.at(0.4), 0.925, 1e-12);
  EXPECT_NEAR(bent.at(0.6), 0.95, 1e-12) << "flat between equal points";
  EXPECT_NEAR(bent.at(0.99), 0.43873375, 1e-12);
}

TEST(MonotoneCurve, RisesWhereItsPointsDoAndGoesOnStraight) {
  const MonotoneCurve steep(Points{{0, 0}, {0.01, 0.5}, {0.5, 0.51}, {0.9, 0.99}, {1, 1}});  // a spline would swing
  double last = -1e-9;
  for (int k = 0; k <= 1000; ++k) {
    const double value = steep.at(k / 1000.0);
    EXPECT_GT(value, last) << k;
    last = value;
  }
  // A line through two points is y = 2 x - 1 everywhere.
  const MonotoneCurve line(Points{{1, 1}, {3, 5}});
  for (const double x : {-2.0, 1.0, 1.7, 3.0, 9.0}) EXPECT_NEAR(line.at(x), 2.0 * x - 1.0, 1e-14);
}

TEST(MonotoneCurve, RefusesPointsThatAreNoCurve) {
  const auto message = [](const Points& points) { return message_of([&] { MonotoneCurve{points}; }); };
  EXPECT_THAT(message({{0, 0}}), HasSubstr("at least 2"));
  EXPECT_THAT(message({{0, 0}, {0.5, 1}, {0.5, 2}}), AllOf(HasSubstr("point 3"), HasSubstr("above the one before")));
  EXPECT_THAT(message({{0, 0}, {1, std::numeric_limits<double>::infinity()}}), HasSubstr("finite"));
}

}  // namespace
}  // namespace touchstone
