// Lamps that can't be are refused with a line that says why.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/error.h"
#include "lamp_scenes.h"
#include "render/scene/lamp_arrays.h"

namespace touchstone::render {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// In glass and gel, as sensor_stack.
void expect_refused(const Lamp& lamp, const std::string& part) {
  Scene scene = sensor_stack(1.0);
  scene.lamps = {lamp};
  try {
    check_scene(scene);
    ADD_FAILURE() << "taken, though " << part;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("lamp 0"));
    EXPECT_THAT(error.what(), testing::HasSubstr(part));
    EXPECT_THAT(std::string(error.what()), testing::Not(testing::HasSubstr("\n")));
  }
}

template <typename Kind, typename Spoil>
void expect_refused(Kind good, Spoil spoil, const std::string& part) {
  Scene scene = sensor_stack(1.0);
  scene.lamps = {good};
  EXPECT_NO_THROW(check_scene(scene));
  spoil(good);
  expect_refused(good, part);
}

LedLamp led() {
  LedLamp lamp;
  lamp.position = {0, 0, -20};
  lamp.radius = 1.0;
  lamp.power_W = grey(1.0);
  return lamp;
}

AreaLamp area() {
  AreaLamp lamp;
  lamp.centre = {0, 0, -20};
  lamp.power_W = grey(1.0);
  return lamp;
}

ProjectedLamp thrown() {
  ProjectedLamp lamp;
  lamp.position = {0, 0, -20};
  lamp.pattern = cv::Mat(4, 6, CV_32FC1, cv::Scalar(0.5));
  lamp.power_W = grey(1.0);
  return lamp;
}

GuideLamp guide() {
  GuideLamp lamp;
  lamp.centre = {-5, 0, -6};
  lamp.power_W = grey(1.0);
  return lamp;
}

TEST(LampCheck, RefusesFaultyLeds) {
  expect_refused(
      led(), [](LedLamp& l) { l.position.x() = kNan; }, "position");
  expect_refused(
      led(), [](LedLamp& l) { l.direction.setZero(); }, "no direction");
  expect_refused(
      led(), [](LedLamp& l) { l.radius = -1.0; }, "radius is -1");
  expect_refused(
      led(), [](LedLamp& l) { l.half_power_angle = 0.0; }, "half_power_angle is 0");
  expect_refused(
      led(), [](LedLamp& l) { l.half_power_angle = 1.6; }, "half_power_angle is 1.6");
  expect_refused(
      led(), [](LedLamp& l) { l.power_W = grey(-1.0); }, "power_W");
  expect_refused(
      led(), [](LedLamp& l) { l.power_W = Spectrum::Ones(3); }, "power_W has 3 bands");
  expect_refused(
      led(), [](LedLamp& l) { l.visible = true, l.radius = 0.0; }, "a visible lamp needs one");
  expect_refused(
      led(), [](LedLamp& l) { l.visible = true, l.half_power_angle = 1.2; }, "at most pi/3");
  expect_refused(
      led(),
      [](LedLamp& l) {
        l.position.z() = -7.5, l.direction = {1, 0, 0};
      },
      "through face 0");
}

TEST(LampCheck, RefusesFaultyAreas) {
  expect_refused(
      area(), [](AreaLamp& l) { l.centre.z() = INFINITY; }, "centre");
  expect_refused(
      area(),
      [](AreaLamp& l) {
        l.along = {0, 0, 2};
      },
      "along is (0, 0, 2)");
  expect_refused(
      area(), [](AreaLamp& l) { l.width = 0.0; }, "width is 0");
  expect_refused(
      area(), [](AreaLamp& l) { l.height = kNan; }, "height is nan");
  expect_refused(
      area(),
      [](AreaLamp& l) {
        l.centre.z() = -5.2, l.direction = {1, 0, 0}, l.along = {0, 1, 0};
      },
      "through face 1");
}

TEST(LampCheck, RefusesFaultyProjectors) {
  expect_refused(
      thrown(),
      [](ProjectedLamp& l) {
        l.up = {0, 0, -1};
      },
      "up is (0, 0, -1)");
  expect_refused(
      thrown(), [](ProjectedLamp& l) { l.pattern = cv::Mat(); }, "pattern is 0 x 0");
  expect_refused(
      thrown(), [](ProjectedLamp& l) { l.pattern = cv::Mat(2, 2, CV_8UC3); }, "OpenCV type");
  expect_refused(
      thrown(), [](ProjectedLamp& l) { l.pattern.at<float>(1, 1) = -0.1f; }, "negative or not finite");
  expect_refused(
      thrown(), [](ProjectedLamp& l) { l.pattern = cv::Mat::zeros(2, 2, CV_32FC1); }, "black all over");
  expect_refused(
      thrown(), [](ProjectedLamp& l) { l.half_width_angle = 1.57; }, "half_width_angle is 1.57");
  expect_refused(
      thrown(), [](ProjectedLamp& l) { l.pattern = cv::Mat(100, 1, CV_8UC1, cv::Scalar(1)); }, "1 x 100 pixels");
}

TEST(LampCheck, RefusesFaultyGuides) {
  expect_refused(
      guide(),
      [](GuideLamp& l) {
        l.direction = {1, 0, 0.1};
      },
      "must be level");
  expect_refused(
      guide(), [](GuideLamp& l) { l.tilt = 1.5; }, "tilt is 1.5");
  expect_refused(
      guide(), [](GuideLamp& l) { l.width = -2.0; }, "width is -2");
  expect_refused(
      guide(), [](GuideLamp& l) { l.half_power_angle = 1.3; }, "at most pi/3");
  expect_refused(
      guide(), [](GuideLamp& l) { l.centre.z() = -3.0; }, "isn't between two flat faces");
  expect_refused(
      guide(), [](GuideLamp& l) { l.centre.z() = -9.0; }, "isn't between two flat faces");
}

TEST(LampCheck, RefusesFaultyArrays) {
  const Eigen::Vector3d end(1, 0, 0);
  EXPECT_THROW(led_strip(led(), -end, end, 0), Error);
  EXPECT_THROW(led_strip(led(), -end, end, 1001), Error);
  EXPECT_THROW(led_strip(led(), -end, {kNan, 0, 0}, 3), Error);
  EXPECT_THROW(led_strip(led(), -end, end, 3, {1, -0.1, 0.0}), Error);
  EXPECT_THROW(led_strip(led(), -end, end, 3, {1, 0.1, 0.6}), Error);
  EXPECT_THROW(led_ring(led(), end, 0.0, -end, 3), Error);
  EXPECT_THROW(led_array(led(), end, end, end, 100, 100), Error);
}

}  // namespace
}  // namespace touchstone::render
