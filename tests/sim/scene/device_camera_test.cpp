#include "sim/scene/device_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

const std::string kLens = R"(type: lens
width: 640
height: 480
pixel_pitch_um: 5.6
focal_length_mm: 4
f_number: 2.8
focus_distance_mm: 25
lens_position_mm: [1, 2, -30]
look_at_mm: [1, 2, 0]
exposure_us: 1000
full_well_e: 10000
)";

std::string with(const std::string& what, const std::string& by) {
  std::string text = kLens;
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

render::LensCamera lens_of(const std::string& text) {
  return std::get<render::LensCamera>(camera_of(parse_yaml<CameraSpec>(text, "camera.yaml")));
}

std::string error_of(const std::string& text) {
  try {
    parse_yaml<CameraSpec>(text, "camera.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(DeviceCamera, ALensIsSharpWhereTheFileSays) {
  const render::LensCamera lens = lens_of(kLens);
  EXPECT_NEAR(render::focal_length_mm(lens), 4.0, 1e-12);
  EXPECT_NEAR(lens.aperture_mm, 4.0 / 2.8, 1e-12);
  EXPECT_EQ(lens.focus_distance_mm, 25.0);
  EXPECT_NEAR(render::sensor_distance_mm(lens), 1.0 / (1.0 / 4.0 - 1.0 / 25.0), 1e-12);
  // A point on the axis appears in the middle of the picture, x to the right, y down.
  EXPECT_NEAR((render::project(lens, {0, 0, 10}) - Eigen::Vector2d(320, 240)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((lens.gel_from_camera * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(2, 4, -27)).norm(), 0.0, 1e-12);

  const double sensor = 1.0 / (1.0 / 4.0 - 1.0 / 25.0);
  const render::LensCamera by_sensor =
      lens_of(with("focus_distance_mm: 25", "sensor_distance_mm: " + std::to_string(sensor)));
  EXPECT_NEAR(by_sensor.focus_distance_mm, 25.0, 1e-4);
  EXPECT_TRUE(std::isinf(lens_of(with("focus_distance_mm: 25\n", "")).focus_distance_mm));
}

TEST(DeviceCamera, ACalibrationsMatrixAndDistortionServeAsTheyAre) {
  const render::LensCamera lens = lens_of(with(
      "focal_length_mm: 4", "camera_matrix: [800, 804, 322.5, 238]\ndistortion: [-0.2, 0.05, 0.001, 0.002, 0.01]"));
  EXPECT_EQ(lens.matrix.fy, 804.0);
  EXPECT_EQ(lens.matrix.cx, 322.5);
  EXPECT_EQ(lens.distortion.p2, 0.002);
  EXPECT_EQ(lens.distortion.k3, 0.01);
  EXPECT_EQ(lens.distortion.k4, 0.0);
  EXPECT_NEAR((render::project(lens, {0, 0, 10}) - Eigen::Vector2d(323.0, 238.5)).norm(), 0.0, 1e-9);
  const double v = std::sqrt(800.0 * 804.0) * 5.6e-3;
  EXPECT_NEAR(lens.aperture_mm, 1.0 / (1.0 / v + 1.0 / 25.0) / 2.8, 1e-12);
  const render::LensCamera rational =
      lens_of(with("f_number: 2.8", "f_number: 2.8\ndistortion: [0.1, 0, 0, 0, 0, 0.2, 0.01, 0.02]"));
  EXPECT_EQ(rational.distortion.k6, 0.02);
}

TEST(DeviceCamera, AMatrixOfAnotherResolutionIsRefused) {
  const auto fault = [](const std::string& matrix) {
    return error_of(with("focal_length_mm: 4", "camera_matrix: " + matrix));
  };
  EXPECT_EQ(fault("[800, 800, 319.5, 239.5]"), "");
  EXPECT_EQ(fault("[800, 800, 420, 180]"), "") << "off the middle, as of a lens that is shifted";
  EXPECT_THAT(fault("[1600, 1600, 641, 478]"), HasSubstr("the principal point (641, 478) is outside the picture of"));
  EXPECT_THAT(fault("[1600, 1600, 620, 470]"), HasSubstr("is in a corner of the picture"));
  EXPECT_THAT(fault("[400, 400, 160, 120]"), HasSubstr("is in a corner of the picture"));
  EXPECT_THAT(fault("[800, 800, -3, 240]"), HasSubstr("outside"));
}

TEST(DeviceCamera, WhatDoesntFitIsRefused) {
  EXPECT_EQ(error_of(kLens), "");
  EXPECT_THAT(error_of(with("type: lens", "type: fisheye")), HasSubstr("fisheye"));
  EXPECT_THAT(error_of(with("focal_length_mm: 4\n", "")),
              HasSubstr("none of focal_length_mm, camera_matrix stands here"));
  EXPECT_THAT(error_of(with("f_number: 2.8", "f_number: 2.8\ncamera_matrix: [800, 800, 320, 240]")),
              HasSubstr("focal_length_mm and camera_matrix stand here together"));
  EXPECT_THAT(error_of(with("f_number: 2.8", "f_number: 2.8\nsensor_distance_mm: 5")),
              HasSubstr("can't stand beside focus_distance_mm"));
  EXPECT_THAT(error_of(with("f_number: 2.8", "f_number: 0.1")), HasSubstr("f_number"));
  EXPECT_THAT(error_of(with("focus_distance_mm: 25", "focus_distance_mm: 3.5")), HasSubstr("focus_distance_mm is 3.5"));
  EXPECT_THAT(error_of(with("focus_distance_mm: 25", "sensor_distance_mm: 3.5")),
              HasSubstr("sensor_distance_mm is 3.5"));
  EXPECT_THAT(error_of(with("f_number: 2.8", "f_number: 2.8\ndistortion: [0.1, 0.2, 0.3]")), HasSubstr("3 numbers"));
  EXPECT_THAT(error_of(with("f_number: 2.8", "f_number: 2.8\ndistortion: [-2, 0, 0, 0]")), HasSubstr("turns back"));
  EXPECT_THAT(error_of(with("f_number: 2.8", "f_number: 2.8\nhole_diameter_um: 100")), HasSubstr("hole_diameter_um"));
  EXPECT_THAT(error_of(with("type: lens", "type: pinhole")), HasSubstr("hole_diameter_um"));
  EXPECT_THAT(error_of(with("look_at_mm: [1, 2, 0]", "look_at_mm: [1, 2, -30]")), HasSubstr("no direction"));
  EXPECT_THAT(error_of(with("look_at_mm: [1, 2, 0]", "look_at_mm: [1, 2, 1e300]")), HasSubstr("mm from the camera"));
  EXPECT_EQ(error_of(with("full_well_e", "bits: 1\nfull_well_e")), "");
  EXPECT_THAT(error_of(with("full_well_e", "bits: 0\nfull_well_e")), HasSubstr("bits"));
}

TEST(DeviceCamera, BlurIsTheLargestAtTheNearOrTheFarEnd) {
  const render::Camera lens = lens_of(kLens);
  const auto& camera = std::get<render::LensCamera>(lens);
  const double px = 5.6e-3;
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(blur_radius_px(lens, 5.0), 0.5 * render::blur_circle_mm(camera, 5.0) / px, 1e-9);
  EXPECT_NEAR(blur_radius_px(lens, 20.0), 0.5 * render::blur_circle_mm(camera, infinite) / px, 1e-9);
}

// The camera turns clockwise, as seen from behind it, so its picture turns in the opposite direction.
TEST(DeviceCamera, ARolledCamerasPictureIsTurnedInTheOppositeDirection) {
  const render::LensCamera upright = lens_of(kLens);
  EXPECT_EQ(error_of(kLens + "roll_deg: -180\n"), "");
  for (const double roll_deg : {-90.0, 3.0, 40.0, 180.0}) {
    const render::LensCamera rolled = lens_of(kLens + "roll_deg: " + std::to_string(roll_deg) + "\n");
    EXPECT_EQ(rolled.gel_from_camera.translation, upright.gel_from_camera.translation);
    const double roll = roll_deg * kRadiansPerDegree;
    for (const Eigen::Vector3d& place :
         {Eigen::Vector3d(1, 2, 0), Eigen::Vector3d(4, 1, -2), Eigen::Vector3d(-3, 5, 1)}) {
      const Eigen::Vector2d middle(320, 240);
      const Eigen::Vector2d before = render::project(upright, upright.gel_from_camera.inverse() * place) - middle;
      const Eigen::Vector2d after = render::project(rolled, rolled.gel_from_camera.inverse() * place) - middle;
      // x to the right and y down: turned by +angle is clockwise.
      EXPECT_LT((after - Eigen::Rotation2Dd(-roll) * before).norm(), 1e-9) << roll_deg;
    }
  }
  EXPECT_THAT(error_of(kLens + "roll_deg: 181\n"), HasSubstr("roll_deg"));
  EXPECT_THAT(error_of(kLens + "roll_deg: .nan\n"), HasSubstr("roll_deg"));
}

}  // namespace
}  // namespace touchstone::sim
