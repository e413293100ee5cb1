#include "sensors/heights/ball_imprint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/units.h"

namespace touchstone::sensors {
namespace {

/// Hertz: a shallow ball on a half-space sinks in by a^2 / R; beyond the contact the surface lies
/// ((2a^2 - r^2) asin(a/r) + a sqrt(r^2 - a^2)) / (pi R) deep.
double hertz_height(double r, double a, double ball) {
  return ((2.0 * a * a - r * r) * std::asin(a / r) + a * std::sqrt(r * r - a * a)) / (kPi * ball);
}

TEST(BallImprint, IsHertzOnAThickGel) {
  const double ball = 10.0;
  const double contact = 0.5;
  const BallImprint imprint(ball, contact, 1000.0);
  EXPECT_NEAR(imprint.depth(), contact * contact / ball, 0.05 * contact * contact / ball);  // 20 radii thick
  for (const double r : {0.6, 0.8, 1.2, 1.6}) {
    // A layer of 20 radii is level with its base far away; the half-space's own surface falls as 1/r.
    const double shift = imprint.depth() - contact * contact / ball;
    EXPECT_NEAR(imprint.height(r), hertz_height(r, contact, ball) + shift, 2e-4 * imprint.depth() + 1e-5) << r;
  }
}

TEST(BallImprint, IsTheBallsCapInsideAndSmoothAcrossTheRim) {
  for (const double thickness : {0.3, 1.0, 4.0, 50.0}) {
    const BallImprint imprint(2.35, 1.6, thickness);
    EXPECT_NEAR(imprint.height(0.0) - imprint.height(1.0), 2.35 - std::sqrt(2.35 * 2.35 - 1.0), 1e-12);
    EXPECT_NEAR(imprint.height(1.6 + 1e-6), imprint.height(1.6), 2e-3 * imprint.depth()) << thickness;
    EXPECT_DOUBLE_EQ(imprint.slope(1.0), -1.0 / std::sqrt(2.35 * 2.35 - 1.0));
    for (const double r : {1.7, 1.9, 2.6, 4.0}) {
      const double h = 0.02;
      const double slope = (imprint.height(r + h) - imprint.height(r - h)) / (2.0 * h);
      EXPECT_NEAR(imprint.slope(r), slope, 0.05 * std::abs(slope) + 3e-3) << thickness << ", " << r;
    }
  }
}

TEST(BallImprint, AnIncompressibleLayerBulgesBesideTheBall) {
  // Its volume stays: what the ball pushes away comes up, near a thin layer's rim and far from a thick one's.
  const double thickness = 1.0;
  const BallImprint imprint(4.0, 1.5, thickness);
  double volume = 0.0;
  double below = 0.0;
  const double step = 1e-3;
  for (double r = 0.5 * step; r < 12.0; r += step) {
    const double part = 2.0 * kPi * r * step * imprint.height(r);
    volume += part;
    below += std::max(part, 0.0);
  }
  EXPECT_LT(std::abs(volume), 0.01 * below);
  EXPECT_LT(imprint.height(2.2), 0.0);
}

TEST(BallImprint, ASteeperContactIsDeeper) {
  double last = 0.0;
  for (const double contact : {0.2, 0.8, 1.4, 2.0, 2.3}) {
    const double depth = BallImprint(2.35, contact, 4.0).depth();
    EXPECT_GT(depth, last);
    last = depth;
  }
}

}  // namespace
}  // namespace touchstone::sensors
