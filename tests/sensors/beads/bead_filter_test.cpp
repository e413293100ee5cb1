#include "sensors/beads/bead_filter.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "core/random.h"
#include "sensors/beads/bead_tracker.h"

namespace touchstone::sensors {
namespace {

constexpr double kInterval = 1.0 / 601.25;

TEST(BeadFilter, ConstantVelocityIsFollowedWithoutBias) {
  BeadFilterSettings settings;
  BeadFilter filter;
  const Eigen::Vector2d start(100.0, 50.0);
  const Eigen::Vector2d velocity(300.0, -200.0);
  filter.start(settings, start);
  for (int i = 1; i <= 200; ++i) {
    filter.predict(settings, kInterval);
    filter.correct(settings, start + i * kInterval * velocity);
  }
  EXPECT_LT((filter.position - (start + 200 * kInterval * velocity)).norm(), 1e-6);
  EXPECT_LT((filter.velocity - velocity).norm(), 1e-3);
}

TEST(BeadFilter, NoiseIsReducedAsItsCovarianceSays) {
  BeadFilterSettings settings;
  settings.acceleration_px_per_s2 = 2000.0;
  RandomStream random(1, 0, Purpose::kTest);
  BeadFilter filter;
  filter.start(settings, {0.0, 0.0});
  double squares = 0.0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    filter.predict(settings, kInterval);
    filter.correct(settings, settings.measurement_px * Eigen::Vector2d(random.normal(), random.normal()));
    if (i >= 100) squares += 0.5 * filter.position.squaredNorm();
  }
  const double rms = std::sqrt(squares / (kSteps - 100));
  EXPECT_LT(rms, 0.8 * settings.measurement_px);
  // A bead at rest has less process noise than the filter allows for, so its error stays below the filter's own claim.
  EXPECT_LT(rms, 1.02 * std::sqrt(filter.covariance(0, 0)));
}

TEST(BeadFilter, ImpulseIsBoundedAndForgotten) {
  BeadFilterSettings settings;
  BeadFilter filter;
  filter.start(settings, {0.0, 0.0});
  const auto step = [&](double x) {
    filter.predict(settings, kInterval);
    filter.correct(settings, {x, 0.0});
    return filter.position.x();
  };
  for (int i = 0; i < 100; ++i) step(0.0);
  double largest = std::abs(step(1.0));
  double last = 0.0;
  for (int i = 0; i < 60; ++i) {
    last = std::abs(step(0.0));
    largest = std::max(largest, last);
  }
  EXPECT_LT(largest, 1.0);
  EXPECT_LT(last, 1e-4);
}

TEST(BeadFilter, VibrationOf100HzPassesAtTheCamerasRate) {
  BeadFilterSettings settings;
  BeadFilter filter;
  filter.start(settings, {0.0, 0.0});
  // Amplitude by correlation over whole periods, after the start has died out.
  double in_phase = 0.0, quadrature = 0.0;
  constexpr int kSteps = 2405;  // 4 s at 601.25 frames/s: 400 periods
  for (int i = 1; i <= 2 * kSteps; ++i) {
    const double angle = 2.0 * 3.14159265358979323846 * 100.0 * i * kInterval;
    filter.predict(settings, kInterval);
    filter.correct(settings, {std::sin(angle), 0.0});
    if (i <= kSteps) continue;
    in_phase += filter.position.x() * std::sin(angle) * 2.0 / kSteps;
    quadrature += filter.position.x() * std::cos(angle) * 2.0 / kSteps;
  }
  const double amplitude = std::hypot(in_phase, quadrature);
  EXPECT_GT(amplitude, 0.7);
  EXPECT_LT(amplitude, 1.3);
}

TEST(BeadFilter, CovarianceStaysPositiveOverLongAndShortIntervals) {
  BeadFilterSettings settings;
  BeadFilter filter;
  filter.start(settings, {1.0, 2.0});
  RandomStream random(2, 0, Purpose::kTest);
  for (int i = 0; i < 5000; ++i) {
    filter.predict(settings, std::pow(10.0, -6.0 + 9.0 * random.uniform()));
    filter.correct(settings, {1.0, 2.0});
    ASSERT_TRUE(filter.position.allFinite() && filter.velocity.allFinite());
    ASSERT_GT(filter.covariance(0, 0), 0.0);
    ASSERT_GE(filter.covariance.determinant(), 0.0);
  }
  EXPECT_LT((filter.position - Eigen::Vector2d(1.0, 2.0)).norm(), 1e-3);
}

}  // namespace
}  // namespace touchstone::sensors
