// Residual maps: files, what they add to light, and that they add nothing where nothing is pressed.

#include "sim/sensor/residual_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

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

constexpr const char* kDevice = R"(name: coated
gel: {size_x_mm: 12, size_y_mm: 12, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, refractive_index: 1.41}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [3, 3], fine_depth_mm: 1}
plate: {thickness_mm: 1, refractive_index: 1.5}
camera: {type: lens, width: 32, height: 24, pixel_pitch_um: 80, focal_length_mm: 6, f_number: 8, focus_distance_mm: 27,
  lens_position_mm: [0, 0, -28], look_at_mm: [0, 0, 0], exposure_us: 100, active_area_um2: 6000, full_well_e: 100000, bayer: binned,
  white_balance: [1, 1.2, 0.9]}
coating: {type: matt, albedo: 0.5}
lamps:
  - {position_mm: [-9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: [0.03, 0.01, 0.01]}
  - {position_mm: [9, 0, -14], target_mm: [0, 0, 0], lens_radius_mm: 0.5, half_angle_deg: 40, power_W: [0.01, 0.03, 0.01]}
)";

ResidualMap some_map() {
  ResidualMap map;
  map.about = "a \"test\"";
  map.presses = 4;
  map.left_out_before_DN = 9;
  map.left_out_after_DN = 3;
  map.width_px = 32;
  map.height_px = 24;
  map.mm_per_px = 0.3;
  map.neighbourhoods_mm = {0.2, 1.0};
  map.slope_scale = 0.5;
  map.height_scale_mm = 0.4;
  map.place_scale_mm = 6.0;
  map.centres = {{0.5, 0.1, 0.8, 0.3, 0.1, 0.5, 0.1, 0}, {-0.5, 0, 0.6, -0.2, 0.1, 0.4, 0, -0.2}};
  map.weights_DN = {{12, -7, 3}, {-4, 9, 20}};
  return map;
}

/// A dent in a picture of 32 x 24 pixels.
cv::Mat dent() {
  cv::Mat height(24, 32, CV_32F);
  for (int v = 0; v < 24; ++v) {
    for (int u = 0; u < 32; ++u) {
      height.at<float>(v, u) = static_cast<float>(0.5 * std::exp(-((u - 17) * (u - 17) + (v - 11) * (v - 11)) / 30.0));
    }
  }
  return height;
}

TEST(ResidualMap, GoesThroughAFile) {
  const test::TemporaryFolder folder;
  const ResidualMap map = some_map();
  const ResidualMap back = read_residual_map(folder.write("map.yaml", to_yaml(map)));
  EXPECT_EQ(back.about, map.about);
  EXPECT_EQ(back.centres, map.centres);
  EXPECT_EQ(back.weights_DN, map.weights_DN);
  EXPECT_EQ(back.place_scale_mm, map.place_scale_mm);
  EXPECT_EQ(to_yaml(back), to_yaml(map));
  EXPECT_EQ(cv::norm(residual_numbers(back, dent()), residual_numbers(map, dent()), cv::NORM_INF), 0.0);
}

TEST(ResidualMap, ABadFileIsNamed) {
  const test::TemporaryFolder folder;
  const auto refused = [&](const std::string& what, const std::string& by) {
    std::string text = to_yaml(some_map());
    const auto at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), by);
    const auto file = folder.write("map.yaml", text);
    return message_of([&] { read_residual_map(file); });
  };
  EXPECT_THAT(refused("version: 1", "version: 2"), AllOf(HasSubstr("map.yaml:3: "), HasSubstr("reads 1")));
  EXPECT_THAT(refused("touchstone residual map", "height map"), HasSubstr("format"));
  EXPECT_THAT(refused("presses:", "pressed:"), HasSubstr("pressed"));
  EXPECT_THAT(refused("[12, -7, 3]", "[12, -7]"), HasSubstr("weights_DN"));
  EXPECT_THAT(refused("[12, -7, 3]", "[12, .nan, 3]"), HasSubstr("weights_DN"));
  EXPECT_THAT(refused("  - [12, -7, 3]\n", ""), HasSubstr("weights_DN: 1 rows, but there are 2 centres"));
  EXPECT_THAT(refused("place_scale_mm: 6\n", ""),
              HasSubstr("centres: number 1 has 8 numbers; 2 neighbourhoods take 6"));
  EXPECT_THAT(refused("neighbourhoods_mm: [0.2, 1]", "neighbourhoods_mm: []"), HasSubstr("from 1 to 8 are allowed"));
  EXPECT_THAT(refused("mm_per_px: 0.3", "mm_per_px: 0"), HasSubstr("mm_per_px"));
}

TEST(ResidualMap, ADeviceThatItIsNotForIsNamed) {
  const test::TemporaryFolder folder;
  folder.write("map.yaml", to_yaml(some_map()));
  const auto read = [&](std::string text, const std::string& what = "", const std::string& by = "") {
    if (!what.empty()) text.replace(text.find(what), what.size(), by);
    return read_device(folder.write("device.yaml", text));
  };
  const std::string with = std::string(kDevice) + "residual: map.yaml\n";
  const DeviceSpec device = read(with);
  ASSERT_TRUE(device.residual);
  EXPECT_EQ(device.residual->presses, 4);
  EXPECT_FALSE(read(kDevice).residual);
  EXPECT_THAT(
      message_of([&] { read(with, "width: 32", "width: 30"); }),
      AllOf(HasSubstr("device.yaml:12: residual: "), HasSubstr("32 x 24 pixels, and the device's camera has 30")));
  EXPECT_THAT(message_of([&] { read(with, "bayer: binned,\n  white_balance: [1, 1.2, 0.9]", ""); }),
              HasSubstr("camera is grey"));
  EXPECT_THAT(message_of([&] { read(with, "coating: {type: matt, albedo: 0.5}\n", ""); }), HasSubstr("no coating"));
  EXPECT_THAT(message_of([&] { read(with, "map.yaml", "none.yaml"); }), HasSubstr("none.yaml"));
}

TEST(ResidualLight, IsExactlyZeroWhereNothingIsPressedAndFadesFarFromWhatWasSeen) {
  const ResidualMap map = some_map();
  const cv::Mat rest = cv::Mat::zeros(24, 32, CV_32F);
  EXPECT_EQ(cv::norm(residual_numbers(map, rest), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(residual_numbers(map, dent()), cv::NORM_INF), 1.0);
  // Ten times as deep and steep as any centre.
  EXPECT_LT(cv::norm(residual_numbers(map, cv::Mat(40 * dent())).rowRange(8, 15).colRange(14, 21), cv::NORM_INF), 0.05);
  cv::Mat unseen = rest.clone();
  unseen.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(cv::norm(residual_numbers(map, unseen), cv::NORM_INF), 0.0);
}

TEST(ResidualLight, IsTheFormulaOfItsFile) {
  ResidualMap map = some_map();
  map.place_scale_mm.reset();
  for (auto& centre : map.centres) centre.resize(6);
  // A plane: slopes are the same in all neighbourhoods, and so is the depth. It is wide enough that no neighbourhood of
  // its middle reaches beyond the picture.
  map.width_px = 64;
  map.height_px = 48;
  cv::Mat plane(48, 64, CV_32F);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) plane.at<float>(v, u) = static_cast<float>(0.3 + 0.03 * (u - 32) - 0.06 * (v - 24));
  }
  Eigen::VectorXd p(6);
  p << 0.03 / 0.3 / 0.5, -0.06 / 0.3 / 0.5, 0.3 / 0.4, 0.03 / 0.3 / 0.5, -0.06 / 0.3 / 0.5, 0.3 / 0.4;
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::VectorXd c = Eigen::Map<const Eigen::VectorXd>(map.centres[k].data(), 6);
    expected += map.weights_DN[k] *
                (std::exp(-0.5 * (p - c).squaredNorm()) - std::exp(-0.5 * (p.squaredNorm() + c.squaredNorm())));
  }
  const cv::Vec3f found = residual_numbers(map, plane).at<cv::Vec3f>(24, 32);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-4);
}

TEST(ResidualLight, ItsNumbersAreTheCameras) {
  DeviceSpec device = parse_yaml<DeviceSpec>(kDevice, "device.yaml");
  SceneBands bands;
  bands.centres_nm = Eigen::Array3d(610, 540, 455);
  const render::Imager camera = imager(device, bands, false);
  cv::Mat light(24, 32, CV_32FC3);
  for (int i = 0; i < 24 * 32; ++i) {
    light.ptr<cv::Vec3f>()[i] =
        cv::Vec3f(1.0f + 0.001f * static_cast<float>(i), 2.0f - 0.001f * static_cast<float>(i), 1.5f);
  }
  // As bright as the camera can take.
  cv::Mat numbers = linear_numbers(light, numbers_per_irradiance(camera));
  double most = 0.0;
  cv::minMaxLoc(numbers.reshape(1), nullptr, &most);
  light *= 180.0 / most;
  numbers = linear_numbers(light, numbers_per_irradiance(camera));
  const cv::Mat frame = render::develop(render::expose(light, camera, 1, 0), camera);
  for (int i = 0; i < 24 * 32; ++i) {
    for (int c = 0; c < 3; ++c) {
      // Rounded twice, the first time before white balance.
      EXPECT_NEAR(frame.ptr<cv::Vec3b>()[i][2 - c], numbers.ptr<cv::Vec3f>()[i][c], 1.15);
    }
  }
  const ResidualMap map = some_map();
  const cv::Mat corrected = ResidualLight(map, camera).corrected(light, dent());
  cv::Mat added = linear_numbers(corrected, numbers_per_irradiance(camera)) - numbers;
  EXPECT_LT(cv::norm(added, residual_numbers(map, dent()), cv::NORM_INF), 1e-3);
  // No light is taken away that isn't there.
  const cv::Mat dark = ResidualLight(map, camera).corrected(cv::Mat(0.0001 * light), dent());
  double least = 0.0;
  cv::minMaxLoc(dark.reshape(1), &least);
  EXPECT_EQ(least, 0.0);

  device.camera->bayer = render::BayerPattern::none;
  EXPECT_THAT(message_of([&] { ResidualLight(map, imager(device, bands, false)); }), HasSubstr("this one is grey"));
}

TEST(ResidualLight, IsInTheFramesOfSensorsAndScenesAndInThePlan) {
  const test::TemporaryFolder folder;
  folder.write("device.yaml", kDevice);
  folder.write("ball.yaml", "{name: ball, shape: {type: sphere, radius_mm: 3}, albedo: 0.4, friction: 0.5}");
  folder.write("press.yaml", "start_mm: [0, 0, 3.2]\nkeys:\n  - {frames: 2, z: {position_mm: 2.6}}\n");
  folder.write("scene.yaml",
               "device: device.yaml\nobject: ball.yaml\nmotion: press.yaml\noutputs: {radiance: true}\n"
               "effects: {direct_light: on}\n");
  const DeviceSpec plain = read_device(folder.path() / "device.yaml");
  DeviceSpec device = plain;
  set_residual(device, std::make_shared<const ResidualMap>(some_map()));

  const VirtualSensor before(plain, folder.path()), after(device, folder.path());
  const ObjectSpec ball = read_object(folder.path() / "ball.yaml");
  EXPECT_EQ(after.light().reason, before.light().reason + "; residual map: " + in_words(some_map()));
  PressSpec press;
  press.depth_mm = 0.5;
  const Touch without = before.press(ball, press), with = after.press(ball, press);
  EXPECT_EQ(cv::norm(before.background_light().reshape(1), after.background_light().reshape(1), cv::NORM_INF), 0.0);
  const cv::Mat expected = before.with_residual(some_map(), without.light, without.height);
  EXPECT_EQ(cv::norm(with.light.reshape(1), expected.reshape(1), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(before.linear_numbers(with.light), before.linear_numbers(without.light), cv::NORM_INF), 1.0);

  SceneSpec scene = read_scene(folder.path() / "scene.yaml");
  const auto frames_of = [&](const DeviceSpec& of) {
    scene.device = of;
    const Plan plan = make_plan(scene);
    const auto gel = set_up_gel(scene.device, folder.path());
    const std::vector<Truth> truths = play_motion(scene, plan, *gel);
    const VirtualCamera camera(scene, plan, *gel, truths);
    std::vector<cv::Mat> lights;
    for (const Truth& truth : truths) lights.push_back(camera.capture(truth).radiance);
    return std::pair(lights, plan);
  };
  const auto [lights, plan] = frames_of(plain);
  const auto [corrected, corrected_plan] = frames_of(device);
  const auto row = [](const Plan& of) {
    for (const Effect& effect : of.effects) {
      if (effect.name == "residual map") return effect.why;
    }
    return std::string();
  };
  EXPECT_EQ(row(plan), "");
  EXPECT_THAT(row(corrected_plan), AllOf(HasSubstr("an empirical correction"), HasSubstr("4 presses (a \"test\")")));
  ASSERT_EQ(lights.size(), corrected.size());
  EXPECT_EQ(cv::norm(lights.front().reshape(1), corrected.front().reshape(1), cv::NORM_INF), 0.0);
  const cv::Mat added = before.linear_numbers(corrected.back()) - before.linear_numbers(lights.back());
  EXPECT_GT(cv::norm(added, cv::NORM_INF), 1.0);
}

}  // namespace
}  // namespace touchstone::sim
