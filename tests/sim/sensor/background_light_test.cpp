// A frame of an untouched unit in a device: pictures show it where nothing is pressed, in sensors and scenes.

#include "sim/sensor/background_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "sim/files/image_file.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/scene.h"
#include "sim/sensor/colour_numbers.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/sensor/virtual_sensor.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kUnit = R"(name: unit
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}
plate: {thickness_mm: 1, refractive_index: 1.5}
camera: {type: lens, width: 32, height: 24, pixel_pitch_um: 80, focal_length_mm: 6, f_number: 8, focus_distance_mm: 27,
  lens_position_mm: [0, 0, -28], look_at_mm: [0, 0, 0], exposure_us: 400, active_area_um2: 6000, full_well_e: 100000, bayer: binned,
  bits: 12, tone_curve: {type: gamma, gamma: 1.8}}
coating: {type: matt, albedo: 0.5}
lamps:
  - {position_mm: [-9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: [0.03, 0.01, 0.01]}
  - {position_mm: [9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: [0.01, 0.03, 0.01]}
)";

/// What a unit with darker corners, a scratch and a tint shows: no picture that the device's lamps make.
cv::Mat untouched_frame() {
  cv::Mat frame(24, 32, CV_8UC3);
  for (int v = 0; v < 24; ++v) {
    for (int u = 0; u < 32; ++u) {
      const double dim = 1.0 - 0.0015 * ((u - 16) * (u - 16) + (v - 12) * (v - 12));
      const cv::Vec3d colour = (v == 5 && u > 20) ? cv::Vec3d(40, 45, 50) : cv::Vec3d(110, 150, 130) * dim;
      frame.at<cv::Vec3b>(v, u) = colour;
    }
  }
  return frame;
}

TEST(Background, TheUntouchedSensorShowsItAndADentChangesItAsBefore) {
  const test::TemporaryFolder folder;
  write_png(folder.path() / "rest.png", untouched_frame());
  const DeviceSpec plain = read_device(folder.write("plain.yaml", kUnit));
  const DeviceSpec device = read_device(folder.write("device.yaml", std::string(kUnit) + "background: rest.png\n"));
  EXPECT_TRUE(plain.background.empty());
  const VirtualSensor before(plain, folder.path()), after(device, folder.path());
  ObjectSpec ball;
  ball.shape.radius_mm = 3;
  PressSpec press;
  press.depth_mm = 0.3;
  const TouchObject object = after.object(ball);
  Touch untouched;
  untouched.light = after.background_light();
  EXPECT_LE(cv::norm(after.ideal(object, untouched), untouched_frame(), cv::NORM_INF), 1.0);
  const Touch was = before.press(before.object(ball), press), is = after.press(object, press);
  const cv::Mat change_before = before.linear_numbers(was.light) - before.linear_numbers(before.background_light());
  const cv::Mat change_after = after.linear_numbers(is.light) - after.linear_numbers(after.background_light());
  EXPECT_GT(cv::norm(change_before, cv::NORM_INF), 10.0);
  // But where a scratch is so dark that no light would be left.
  int dark = 0;
  for (int i = 0; i < 24 * 32; ++i) {
    for (int c = 0; c < 3; ++c) {
      const float wanted = change_before.ptr<cv::Vec3f>()[i][c], found = change_after.ptr<cv::Vec3f>()[i][c];
      if (std::abs(found - wanted) > 0.01f) ++dark;
    }
  }
  EXPECT_LE(dark, 3 * 11);
}

TEST(Background, ScenesShowItToo) {
  const test::TemporaryFolder folder;
  write_png(folder.path() / "rest.png", untouched_frame());
  folder.write("device.yaml", std::string(kUnit) + "background: rest.png\n");
  folder.write("ball.yaml", "{name: ball, shape: {type: sphere, radius_mm: 3}, albedo: 0.4, friction: 0.5}");
  folder.write("press.yaml", "start_mm: [0, 0, 3.2]\nkeys:\n  - {frames: 2, z: {position_mm: 2.7}}\n");
  for (const char* light : {"on", "off"}) {
    const SceneSpec scene = read_scene(folder.write(
        "scene.yaml",
        fmt::format("device: device.yaml\nobject: ball.yaml\nmotion: press.yaml\noutputs: {{ideal: true}}\n"
                    "effects: {{direct_light: {}}}\n",
                    light)));
    const Plan plan = make_plan(scene);
    const auto gel = set_up_gel(scene.device, folder.path());
    const std::vector<Truth> truths = play_motion(scene, plan, *gel);
    const VirtualCamera camera(scene, plan, *gel, truths);
    const cv::Mat rest = camera.capture(truths.front()).ideal, pressed = camera.capture(truths.back()).ideal;
    // Paths have noise, in the picture and in the untouched one that it's compared with.
    EXPECT_LE(cv::norm(rest, untouched_frame(), cv::NORM_INF), light == std::string("on") ? 1.0 : 12.0) << light;
    EXPECT_GT(cv::norm(pressed, untouched_frame(), cv::NORM_INF), 10.0) << light;
    const bool said = std::any_of(plan.effects.begin(), plan.effects.end(),
                                  [](const Effect& effect) { return effect.name == "background" && effect.on; });
    EXPECT_TRUE(said);
  }
}

TEST(Background, FullScaleSaysOnlyThatThereIsAtLeastSoMuchLight) {
  const DeviceSpec device = parse_yaml<DeviceSpec>(kUnit, "device.yaml");
  SceneBands bands;
  bands.centres_nm = Eigen::Array3d(610, 540, 455);
  render::Imager camera = imager(device, bands, false);
  camera.tone_curve = render::LinearTone{};
  const cv::Mat frame(24, 32, CV_8UC3, cv::Scalar(100, 255, 200));  // blue, green, red
  const Eigen::MatrixX3d of_number = irradiance_per_number(camera);
  const cv::Mat nothing = cv::Mat::zeros(24, 32, CV_32FC3);
  cv::Mat light = with_numbers(nothing, cv::Mat(24, 32, CV_32FC3, cv::Scalar(150, 300, 120)), of_number);
  const cv::Vec3f bright = missing_at_rest(frame, light, camera).at<cv::Vec3f>(3, 4);  // red, green, blue
  EXPECT_NEAR(bright[0], 50, 1e-2);
  EXPECT_EQ(bright[1], 0);
  EXPECT_NEAR(bright[2], -20, 1e-2);
  light = with_numbers(nothing, cv::Mat(24, 32, CV_32FC3, cv::Scalar(150, 200, 120)), of_number);
  EXPECT_NEAR(missing_at_rest(frame, light, camera).at<cv::Vec3f>(3, 4)[1], 55, 1e-2);
}

TEST(Background, ADeviceThatItIsNotForIsNamed) {
  const test::TemporaryFolder folder;
  write_png(folder.path() / "rest.png", untouched_frame());
  write_png(folder.path() / "grey.png", cv::Mat(24, 32, CV_8UC1, cv::Scalar(90)));
  write_png(folder.path() / "deep.png", cv::Mat(24, 32, CV_16UC3, cv::Scalar(90, 90, 90)));
  const std::string with = std::string(kUnit) + "background: rest.png\n";
  const auto refused = [&](const std::string& what, const std::string& by) {
    std::string text = with;
    text.replace(text.find(what), what.size(), by);
    return message_of([&] { read_device(folder.write("device.yaml", text)); });
  };
  EXPECT_THAT(refused("rest.png", "none.png"), AllOf(HasSubstr("device.yaml:12: background: "), HasSubstr("none.png")));
  EXPECT_THAT(refused("rest.png", "grey.png"), HasSubstr("grey.png: has 1 channels of 8 bits"));
  EXPECT_THAT(refused("rest.png", "deep.png"), HasSubstr("has 3 channels of 16 bits"));
  EXPECT_THAT(refused("width: 32", "width: 30"),
              HasSubstr("is of 32 x 24 pixels, and the device's camera has 30 x 24"));
  EXPECT_THAT(refused("bayer: binned,\n  bits: 12, tone_curve: {type: gamma, gamma: 1.8}", ""),
              HasSubstr("camera is grey"));
  EXPECT_THAT(refused("coating: {type: matt, albedo: 0.5}\n", ""), HasSubstr("no coating"));
}

}  // namespace
}  // namespace touchstone::sim
