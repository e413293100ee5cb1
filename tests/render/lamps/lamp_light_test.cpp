// What lamps send, against closed forms.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "closed_forms/light_closed_forms.h"
#include "lamp_scenes.h"
#include "render/scene/lamp_arrays.h"

namespace touchstone::render {
namespace {

Scene lit_by(const Lamp& lamp) {
  Scene scene = empty_scene(0.0);
  scene.lamps = {lamp};
  return scene;
}

LedLamp led_above(double height, double radius, double half_power_deg, double power) {
  LedLamp led;
  led.position = {0, 0, height};
  led.direction = {0, 0, -1};
  led.radius = radius;
  led.half_power_angle = half_power_deg * kRadiansPerDegree;
  led.power_W = grey(power);
  return led;
}

// E = I0 cos^m cos / r^2 with I0 = P (m + 1) / (2 pi), m = ln(1/2) / ln cos(half-power angle).
TEST(Led, LightsByItsLobeAndTheInverseSquare) {
  for (double half_power_deg : {15.0, 30.0, 60.0}) {
    const LedLamp led = led_above(10.0, 0.0, half_power_deg, 2.0);
    const double m = std::log(0.5) / std::log(std::cos(half_power_deg * kRadiansPerDegree));
    for (double x : {0.0, 3.0, 12.0}) {
      const double r = std::hypot(10.0, x);
      const double expected = 2.0 * (m + 1.0) / (2.0 * kPi) * std::pow(10.0 / r, m + 1.0) / (r * r) * 1e6;
      EXPECT_NEAR(irradiance_at(lit_by(led), x, 0, 1, 1) / expected, 1.0, 1e-6) << half_power_deg << " at " << x;
    }
  }
}

TEST(Led, SendsHalfAtItsHalfPowerAngle) {
  LedLamp led = led_above(10.0, 0.0, 15.0, 1.0);
  const double on_axis = irradiance_at(lit_by(led), 0, 0, 1, 1);
  led.direction = {std::sin(15.0 * kRadiansPerDegree), 0, -std::cos(15.0 * kRadiansPerDegree)};
  EXPECT_NEAR(irradiance_at(lit_by(led), 0, 0, 1, 1) / on_axis, 0.5, 1e-9);
}

// Of a matt disc's light the share F12 = 1/2 [S - sqrt(S^2 - 4 (R2/R1)^2)] meets a coaxial disc, S = 1 + (1 + R2^2) /
// R1^2, R = radius / distance.
TEST(Led, MattDiscsExchangeWhatTheirFormFactorSays) {
  const double r1 = 3.0;
  const double r2 = 2.0;
  const double distance = 2.5;
  const double big_1 = r1 / distance;
  const double big_2 = r2 / distance;
  const double s = 1.0 + (1.0 + big_2 * big_2) / (big_1 * big_1);
  const double expected = 0.5 * (s - std::sqrt(s * s - 4.0 * std::pow(big_2 / big_1, 2)));
  const LedLamp disc = led_above(distance, r1, 60.0, 1.0);
  constexpr int kRings = 64;
  double caught = 0.0;
  for (int i = 0; i < kRings; ++i) {
    const double r = r2 * (i + 0.5) / kRings;
    caught += irradiance_at(lit_by(disc), r, 0, 1, 1 << 12) * 1e-6 * 2.0 * kPi * r * r2 / kRings;
  }
  EXPECT_NEAR(caught / expected, 1.0, 2e-3);
}

/// F from a small level patch to a parallel rectangle at height c, whose corner stands over the patch, with sides a and
/// b: [A / sqrt(1 + A^2) atan(B / sqrt(1 + A^2)) + B / sqrt(1 + B^2) atan(A / sqrt(1 + B^2))] / (2 pi).
double corner_factor(double a, double b, double c) {
  const double big_a = a / c;
  const double big_b = b / c;
  const double root_a = std::sqrt(1.0 + big_a * big_a);
  const double root_b = std::sqrt(1.0 + big_b * big_b);
  return (big_a / root_a * std::atan(big_b / root_a) + big_b / root_b * std::atan(big_a / root_b)) / (2.0 * kPi);
}

TEST(Area, LightsAPatchAsTheRectanglesFormFactorSays) {
  AreaLamp area;
  area.centre = {0, 0, 3.0};
  area.direction = {0, 0, -1};
  area.along = {1, 0.0, 0.5};  // the part along the lamp's normal counts for nothing
  area.width = 4.0;
  area.height = 2.0;
  area.power_W = grey(0.5);
  const double radiance = 0.5 / (kPi * 8.0 * 1e-6);
  const double at_centre = kPi * radiance * 4.0 * corner_factor(2.0, 1.0, 3.0);
  EXPECT_NEAR(irradiance_at(lit_by(area), 0, 0, 1, 1 << 12) / at_centre, 1.0, 1e-3);
  const double at_corner = kPi * radiance * corner_factor(4.0, 2.0, 3.0);
  EXPECT_NEAR(irradiance_at(lit_by(area), 2, 1, 1, 1 << 12) / at_corner, 1.0, 1e-3);
  // 1 mm further out along x: the rectangle of 5 x 2 less that of 1 x 2.
  const double outside = kPi * radiance * (corner_factor(5.0, 2.0, 3.0) - corner_factor(1.0, 2.0, 3.0));
  EXPECT_NEAR(irradiance_at(lit_by(area), 3, 1, 1, 1 << 12) / outside, 1.0, 1e-3);
}

ProjectedLamp projector(const cv::Mat& pattern) {
  ProjectedLamp lamp;
  lamp.position = {0, 0, 20};
  lamp.direction = {0, 0, -1};
  lamp.up = {0, 1, 0.3};
  lamp.half_width_angle = std::atan(0.5);  // 10 mm to either side on the sheet
  lamp.pattern = pattern;
  lamp.power_W = grey(1.5);
  return lamp;
}

// An even pattern: all of the power on 20 x 10 mm, the same everywhere.
TEST(Projector, ThrowsAnEvenPatternEvenly) {
  const Scene scene = lit_by(projector(cv::Mat(8, 16, CV_8UC1, cv::Scalar(77))));
  const double expected = 1.5 / (20.0 * 10.0 * 1e-6);
  for (double x : {0.0, 9.9, -9.9}) {
    for (double y : {0.0, 4.9, -4.9}) {
      EXPECT_NEAR(irradiance_at(scene, x, y, 1, 1) / expected, 1.0, 1e-6) << x << " " << y;
    }
  }
  EXPECT_EQ(irradiance_at(scene, 10.1, 0, 1, 1), 0.0);
  EXPECT_EQ(irradiance_at(scene, 0, 5.1, 1, 1), 0.0);
}

// The first row is towards `up`, the last column to the right of who looks along with the projector.
TEST(Projector, KeepsThePatternsSides) {
  cv::Mat pattern = cv::Mat::zeros(2, 4, CV_32FC1);
  pattern.at<float>(0, 3) = 1.0f;  // top right
  pattern.at<float>(1, 0) = 0.25f;
  const Scene scene = lit_by(projector(pattern));
  const double whole = 1.5 / (5.0 * 5.0 * 1e-6) / 1.25;
  // Right is direction x up = (0, 0, -1) x (0, 1, 0) = +x.
  EXPECT_NEAR(irradiance_at(scene, 7.0, 3.0, 1, 1) / whole, 1.0, 1e-6);
  EXPECT_NEAR(irradiance_at(scene, -7.0, -3.0, 1, 1) / whole, 0.25, 1e-6);
  EXPECT_EQ(irradiance_at(scene, -7.0, 3.0, 1, 1), 0.0);
  EXPECT_EQ(irradiance_at(scene, 7.0, -3.0, 1, 1), 0.0);
}

TEST(EveryLamp, SendsItsPowerAllInAll) {
  Scene plate = empty_scene(0.0);
  plate.faces = {{-1.0, 0, 0}, {2.0, 0, 0}};  // of no optical effect, so a guide's light leaves it as it came
  const Eigen::Vector3d direction(0.4, -0.5, 0.8);
  SpotLamp spot;
  spot.direction = direction;
  spot.lens_radius = 2.0;
  LedLamp led;
  led.direction = direction;
  led.radius = 1.0;
  led.half_power_angle = 0.4;
  AreaLamp area;
  area.direction = direction;
  area.half_power_angle = 0.9;
  ProjectedLamp thrown = projector(cv::Mat(8, 16, CV_8UC1, cv::Scalar(77)));
  thrown.pattern.at<unsigned char>(3, 3) = 0;
  thrown.position.setZero();
  thrown.direction = direction;
  GuideLamp level;
  level.centre = {0, 0, 0.5};
  level.direction = {0.6, 0.8, 0};
  level.half_power_angle = 0.3;
  level.width = 3.0;
  GuideLamp rising = level;
  rising.tilt = 0.6;
  rising.half_power_angle = 0.8;  // part of the lobe is cut off
  for (Lamp lamp : {Lamp(spot), Lamp(led), Lamp(area), Lamp(thrown), Lamp(level), Lamp(rising)}) {
    std::visit([](auto& one) { one.power_W = grey(0.7); }, lamp);
    plate.lamps = {lamp};
    EXPECT_NEAR(power_on_all_sides(plate, 10000) / 0.7, 1.0, 0.01) << "kind " << lamp.index();
  }
}

// A lamp inside the glass: its light starts there.
TEST(Led, InsideAPlateLightsTheGelAsBisectionSays) {
  Scene scene = sensor_stack(0.0);
  LedLamp led = led_above(-6.0, 0.0, 60.0, kPi);  // intensity: the cosine
  led.direction = {0, 0, 1};
  scene.lamps.push_back(led);
  const std::array<double, 2> thicknesses = {1.0, 5.0};
  const std::array<double, 2> indices = {1.52, 1.41};
  for (double x : {0.0, 2.0, 8.0}) {
    const double sine = std::sin(std::atan(closed_forms::apparent_tangent(thicknesses, indices, x)));
    const double sine_in_gel = 1.52 * sine / 1.41;
    const double expected = closed_forms::layered_irradiance(thicknesses, indices, x) * std::sqrt(1.0 - sine * sine) *
                            std::sqrt(1.0 - sine_in_gel * sine_in_gel);
    // radiance() is L / n^2.
    EXPECT_NEAR(1.41 * 1.41 * irradiance_at(scene, x, 0, -1, 1) / expected, 1.0, 1e-5) << x;
  }
}

TEST(LedStrip, OfManyIsAThinAreaLamp) {
  const LedLamp one = led_above(0.0, 0.0, 60.0, 0.01);
  Scene leds = empty_scene(0.0);
  for (const LedLamp& led : led_array(one, {-5, 0, 6}, {10, 0, 0}, {0, 1e-3, 0}, 32, 1)) leds.lamps.push_back(led);
  AreaLamp area;
  area.centre = {0, 0, 6};
  area.direction = {0, 0, -1};
  area.width = 10.0;
  area.height = 1e-3;
  area.power_W = grey(0.32);
  for (double x : {0.0, 4.0, 9.0}) {
    const double by_leds = irradiance_at(leds, x, 1, 1, 1 << 12);
    EXPECT_NEAR(by_leds / irradiance_at(lit_by(area), x, 1, 1, 1 << 12), 1.0, 2e-3) << x;
  }
}

TEST(LedStrip, StandsBetweenItsEnds) {
  const LedLamp one = led_above(0.0, 0.5, 15.0, 1.0);
  const auto strip = led_strip(one, {0, 0, 1}, {9, 3, 1}, 4);
  ASSERT_EQ(strip.size(), 4u);
  EXPECT_EQ(strip[0].position, Eigen::Vector3d(0, 0, 1));
  EXPECT_TRUE(strip[2].position.isApprox(Eigen::Vector3d(6, 2, 1)));
  EXPECT_EQ(strip[3].power_W[0], 1.0);
  EXPECT_TRUE(led_strip(one, {0, 0, 1}, {9, 3, 1}, 1)[0].position.isApprox(Eigen::Vector3d(4.5, 1.5, 1)));
  for (const LedLamp& led : led_ring(one, {1, 2, 3}, 4.0, {1, 2, 0}, 5)) {
    EXPECT_NEAR((led.position - Eigen::Vector3d(1, 2, 3)).norm(), 4.0, 1e-12);
    EXPECT_TRUE((led.position + led.direction).isApprox(Eigen::Vector3d(1, 2, 0)));
  }
}

TEST(LedSpread, VariesPowerAndAxisAsAskedAndKeepsTheMean) {
  const LedLamp one = led_above(0.0, 0.0, 15.0, 2.0);
  const LedSpread spread{11, 0.1, 0.05};
  const auto leds = led_strip(one, {0, 0, 0}, {1, 0, 0}, 1000, spread);
  double sum = 0.0;
  double squares = 0.0;
  double lean2 = 0.0;
  for (const LedLamp& led : leds) {
    const double log_power = std::log(led.power_W[0] / 2.0);
    sum += led.power_W[0] / 2.0;
    squares += log_power * log_power;
    lean2 += std::pow(std::acos(-led.direction.z()), 2);
  }
  EXPECT_NEAR(sum / 1000, 1.0, 4 * 0.1 / std::sqrt(1000.0));
  EXPECT_NEAR(std::sqrt(squares / 1000), 0.1, 4 * 0.1 / std::sqrt(2000.0));
  EXPECT_NEAR(std::sqrt(lean2 / 2000), 0.05, 4 * 0.05 / std::sqrt(4000.0));  // about each of two axes

  const auto again = led_strip(one, {0, 0, 0}, {1, 0, 0}, 1000, spread);
  const auto other = led_strip(one, {0, 0, 0}, {1, 0, 0}, 1000, {12, 0.1, 0.05});
  EXPECT_TRUE(same_lamp(leds[7], again[7]));
  EXPECT_FALSE(same_lamp(leds[7], other[7]));
  EXPECT_TRUE(same_lamp(led_strip(one, {0, 0, 0}, {1, 0, 0}, 3, {12, 0.0, 0.0})[0], one)) << "no spread, no change";
}

}  // namespace
}  // namespace touchstone::render
