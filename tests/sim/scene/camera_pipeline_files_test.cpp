// What a device file says of its camera's tone curve, JPEG, hot pixels, automatic control and vignetting; what the plan
// makes of it; and what is refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/plan/plan.h"
#include "sim/scene/device_imager.h"
#include "tests/sim/press/moving_scene.h"
#include "tests/support/message_of.h"

namespace touchstone::sim {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

const char* const kCamera = R"(type: lens
width: 640
height: 480
frame_rate_Hz: 30
pixel_pitch_um: 6
focal_length_mm: 4
f_number: 2.8
lens_position_mm: [0, 0, -18]
look_at_mm: [0, 0, 0]
exposure_us: 5000
full_well_e: 10000
bayer: rggb
)";

CameraSpec camera_with(const std::string& lines) {
  return parse_yaml<CameraSpec>(kCamera + lines, "camera.yaml");
}

std::string error_of(const std::string& lines) {
  return message_of([&] { camera_with(lines); });
}

TEST(CameraPipelineFiles, EachBlockBecomesWhatTheImagerTakes) {
  DeviceSpec device;
  device.camera = camera_with(
      "vignetting: {polynomial: [-0.3, 0.05]}\n"
      "hot_pixels: {share: 0.0005, dark_current_e_per_s: 30000, spread: 0.7}\n"
      "auto_exposure: {time_constant_s: 0.3, mean_level: 0.25, exposure_factors: [0.1, 6]}\n"
      "auto_white_balance: {time_constant_s: 1.5, gain_factors: [0.5, 2]}\n"
      "tone_curve: {type: gamma, gamma: 2.4}\n"
      "jpeg: {quality: 85, chroma: 4:2:0}\n"
      "white_balance: [1.4, 1, 1.8]\n");
  SceneBands bands;
  bands.centres_nm = Eigen::Array3d(610, 540, 450);
  const render::Imager made = imager(device, bands, true);
  EXPECT_NO_THROW(render::check(made));
  EXPECT_EQ(made.hot_pixels.share, 0.0005);
  EXPECT_EQ(made.hot_pixels.dark_current_e_per_s, 30000.0);
  EXPECT_EQ(made.hot_pixels.spread, 0.7);
  ASSERT_TRUE(made.auto_exposure && made.auto_white_balance && made.jpeg);
  EXPECT_EQ(made.auto_exposure->time_constant_s, 0.3);
  EXPECT_EQ(made.auto_exposure->mean_level, 0.25);
  EXPECT_EQ(made.auto_exposure->lowest, 0.1);
  EXPECT_EQ(made.auto_exposure->highest, 6.0);
  EXPECT_EQ(made.auto_white_balance->time_constant_s, 1.5);
  EXPECT_EQ(made.auto_white_balance->lowest, 0.5);
  EXPECT_EQ(made.jpeg->quality, 85);
  EXPECT_EQ(made.jpeg->chroma, render::JpegChroma::quarter);
  EXPECT_EQ(std::get<render::GammaTone>(made.tone_curve).gamma, 2.4);
  EXPECT_EQ(made.white_balance, Eigen::Vector3d(1.4, 1.0, 1.8));
  // Half of the diagonal is 400 pixels: the corner's weight is 1 - 0.3 + 0.05 of what cos^4 leaves.
  const auto lens = std::get<LensSpec>(device.camera->optics);
  ASSERT_TRUE(lens.vignetting);
  EXPECT_NEAR(render::vignetting_at(*lens.vignetting, 1.0), 0.75, 1e-12);
}

TEST(CameraPipelineFiles, TheOtherFormsOfAToneCurveAndOfVignetting) {
  using Tone = render::ToneCurve;
  const auto tone = [](const std::string& block) { return camera_with("tone_curve: " + block + "\n").tone_curve; };
  EXPECT_TRUE(std::holds_alternative<render::LinearTone>(tone("{type: linear}")));
  EXPECT_TRUE(std::holds_alternative<render::SrgbTone>(tone("{type: srgb}")));
  const Tone points = tone("{type: points, points: [[0, 0], [0.2, 0.5], [1, 1]]}");
  EXPECT_NEAR(render::delivered(points, 0.2), 0.5, 1e-12);
  const auto lens = std::get<LensSpec>(camera_with("vignetting: {points: [[0, 1], [1, 0.6]]}\n").optics);
  EXPECT_NEAR(render::vignetting_at(*lens.vignetting, 0.5), 0.8, 1e-12);
}

TEST(CameraPipelineFiles, WithoutTheBlocksNothingIsDone) {
  const CameraSpec camera = camera_with("");
  EXPECT_EQ(camera.hot_pixels.share, 0.0);
  EXPECT_FALSE(camera.auto_exposure || camera.auto_white_balance || camera.jpeg);
  EXPECT_TRUE(std::holds_alternative<render::LinearTone>(camera.tone_curve));
  EXPECT_FALSE(std::get<LensSpec>(camera.optics).vignetting);
}

TEST(CameraPipelineFiles, MistakesNameFileLineFieldValueAndWhatIsAllowed) {
  const auto names = [](const std::string& line, const std::vector<std::string>& parts) {
    const std::string message = error_of(line);
    EXPECT_THAT(message, HasSubstr("camera.yaml:13")) << line;
    for (const std::string& part : parts) EXPECT_THAT(message, HasSubstr(part)) << line;
  };
  names("tone_curve: {type: log}\n", {"log", "linear, srgb, gamma, points"});
  names("tone_curve: {type: gamma}\n", {"gamma"});
  names("tone_curve: {type: gamma, gamma: 0}\n", {"tone_curve.gamma", "0", "from 0.1 to 10"});
  names("tone_curve: {type: srgb, gamma: 2}\n", {"gamma"});
  names("tone_curve: {type: points, points: [[0, 0], [0.5, 0.8], [1, 0.8]]}\n", {"point 3", "0.8", "above"});
  names("tone_curve: {type: points, points: [[0, 0], [0.5, 0.4], [0.5, 1]]}\n", {"point 3", "0.5", "above"});
  names("tone_curve: {type: points, points: [[0, 0], [0.9, 1]]}\n", {"0 to 0.9", "from 0 to 1"});
  names("tone_curve: {type: points, points: [[0, 0], [1, 1.5]]}\n", {"1.5", "from 0 to 1"});
  names("jpeg: {quality: 0}\n", {"jpeg.quality", "0", "from 1 to 100"});
  names("jpeg: {quality: 90, chroma: 4:2:2}\n", {"4:2:2", "4:4:4, 4:2:0"});
  names("jpeg: {}\n", {"quality"});
  names("hot_pixels: {share: 0.7, dark_current_e_per_s: 10}\n", {"hot_pixels.share", "0.7", "from 0 to 0.5"});
  names("hot_pixels: {share: 0.001}\n", {"dark_current_e_per_s"});
  names("auto_exposure: {time_constant_s: 0, mean_level: 0.2}\n", {"time_constant_s", "0", "from 1e-06"});
  names("auto_exposure: {time_constant_s: 1, mean_level: 1.2}\n", {"mean_level", "1.2", "from 0.001 to 0.9"});
  names("auto_exposure: {time_constant_s: 1, mean_level: 0.2, exposure_factors: [2, 1]}\n",
        {"exposure_factors", "2 and 1", "larger"});
  // 5 ms times 8 are 40 ms; a frame has 33.3.
  names("auto_exposure: {time_constant_s: 1, mean_level: 0.2, exposure_factors: [0.5, 8]}\n",
        {"40000 us", "longer than a frame"});
  names("auto_white_balance: {time_constant_s: 1, gain_factors: [0, 2]}\n", {"gain_factors", "0", "from 0.001"});
  names("vignetting: {}\n", {"polynomial, points"});
  names("vignetting: {polynomial: []}\n", {"polynomial", "1 to 8"});
  names("vignetting: {polynomial: [-2]}\n", {"vignetting", "from 0 to 10"});
  names("vignetting: {points: [[0, 1], [0.8, 0.9]]}\n", {"vignetting", "0.8", "corner"});
}

TEST(CameraPipelineFiles, WhatDoesNotGoTogetherIsRefused) {
  const std::string grey = message_of([] {
    std::string text = kCamera;
    text.replace(text.find("rggb"), 4, "none");
    parse_yaml<CameraSpec>(text + "auto_white_balance: {time_constant_s: 1}\n", "camera.yaml");
  });
  EXPECT_THAT(grey, AllOf(HasSubstr("camera.yaml:13"), HasSubstr("auto_white_balance"), HasSubstr("grey")));
  const std::string chip = message_of([] {
    parse_yaml<CameraSpec>(
        "preset: adns2620\nhole_diameter_um: 80\nhole_to_sensor_mm: 5\nhole_position_mm: [0, 0, -18]\n"
        "look_at_mm: [0, 0, 0]\nexposure_us: 300\nmotion_chip: {}\njpeg: {quality: 90}\n",
        "camera.yaml");
  });
  EXPECT_THAT(chip, AllOf(HasSubstr("motion_chip"), HasSubstr("jpeg")));
  // A hole has its own fall-off, by its foil.
  EXPECT_THAT(message_of([] {
                parse_yaml<CameraSpec>(
                    "preset: c310\nhole_diameter_um: 80\nhole_to_sensor_mm: 5\nhole_position_mm: [0, 0, -18]\n"
                    "look_at_mm: [0, 0, 0]\nexposure_us: 300\nvignetting: {polynomial: [-0.1]}\n",
                    "camera.yaml");
              }),
              AllOf(HasSubstr("camera.yaml:7"), HasSubstr("vignetting")));
}

const Effect& effect(const Plan& plan, const std::string& name) {
  const auto found =
      std::find_if(plan.effects.begin(), plan.effects.end(), [&](const Effect& one) { return one.name == name; });
  EXPECT_NE(found, plan.effects.end()) << name;
  return *found;
}

TEST(CameraPipelinePlan, SaysOfEachStepWhetherTheDeviceStatesIt) {
  SceneSpec scene = moving_scene("  - {frames: 2, z: {position_mm: 1.6}}\n");
  const Plan without = make_plan(scene);
  for (const char* name : {"vignetting", "hot pixels", "auto exposure", "auto white balance", "tone curve", "JPEG"}) {
    EXPECT_FALSE(effect(without, name).on) << name;
    EXPECT_FALSE(effect(without, name).why.empty()) << name;
    EXPECT_EQ(effect(without, name).cost, "nothing") << name;
  }
  CameraSpec& camera = *scene.device.camera;
  camera.hot_pixels = {.share = 0.001, .dark_current_e_per_s = 1e4};
  camera.auto_exposure = render::AutoExposure{};
  camera.tone_curve = render::SrgbTone{};
  camera.jpeg = render::JpegSettings{.quality = 77};
  const Plan with = make_plan(scene);
  EXPECT_TRUE(with.hot_pixels && with.auto_exposure && with.tone_curve && with.jpeg);
  EXPECT_FALSE(with.auto_white_balance || with.vignetting);
  EXPECT_THAT(effect(with, "JPEG").why, HasSubstr("77"));
  EXPECT_THAT(effect(with, "tone curve").why, HasSubstr("sRGB"));
  scene.effects.sensor_noise = Switch::off;
  const Plan ideal = make_plan(scene);
  EXPECT_FALSE(ideal.hot_pixels || ideal.jpeg) << "ideal pictures have neither";
  EXPECT_TRUE(ideal.tone_curve && ideal.auto_exposure);
  camera.exposure_us = 4000.0;  // times 4, at the motion's 100 frames a second
  EXPECT_THAT(message_of([&] { make_plan(scene); }), HasSubstr("auto_exposure"));
}

}  // namespace
}  // namespace touchstone::sim
