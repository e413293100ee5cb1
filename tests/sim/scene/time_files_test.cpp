// What device and scene files say of time: presets, row times, event pixels; and what is refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "render/imager/imager_presets.h"
#include "sim/plan/plan.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"
#include "tests/sim/press/moving_scene.h"

namespace touchstone::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const char* const kPose =
    "hole_diameter_um: 80\nhole_to_sensor_mm: 5\nhole_position_mm: [0, 0, -18]\nlook_at_mm: [0, 0, 0]\n";

CameraSpec camera_with(const std::string& lines) {
  return parse_yaml<CameraSpec>(kPose + lines, "camera.yaml");
}

std::string error_of(const std::string& lines) {
  try {
    camera_with(lines);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(CameraPreset, GivesTheImagersOwnFigures) {
  for (const std::string_view name : render::imager_preset_names()) {
    DeviceSpec device;
    device.band_wavelengths_nm = {610, 540, 450};
    device.camera = camera_with(fmt::format("preset: {}\nexposure_us: 300\nwhite_balance: [1, 1, 1]\n", name));
    const render::ImagerPreset preset = render::imager_preset(name, 3e-4);
    SceneBands bands;
    bands.centres_nm = Eigen::Array3d(610, 540, 450);
    const render::Imager made = imager(device, bands, true);
    EXPECT_EQ(device.camera->width, preset.width) << name;
    EXPECT_EQ(device.camera->height, preset.height) << name;
    EXPECT_EQ(device.camera->pixel_pitch_um, preset.pixel_pitch_um) << name;
    EXPECT_EQ(device.camera->frame_rate_Hz, preset.frame_rate_Hz) << name;
    EXPECT_NEAR(device.camera->row_time_us, 1e6 * preset.line_time_s, 1e-9) << name;
    EXPECT_EQ(made.bits, preset.imager.bits) << name;
    EXPECT_EQ(made.bayer, preset.imager.bayer) << name;
    EXPECT_EQ(made.active_area_um2, preset.imager.active_area_um2) << name;
    EXPECT_EQ(made.read_noise_e, preset.imager.read_noise_e) << name;
    EXPECT_EQ(made.dark_current_e_per_s, preset.imager.dark_current_e_per_s) << name;
    EXPECT_EQ(made.prnu, preset.imager.prnu) << name;
    EXPECT_EQ(made.dsnu_e, preset.imager.dsnu_e) << name;
    EXPECT_EQ(made.black_level_DN, preset.imager.black_level_DN) << name;
    EXPECT_NEAR(made.gain_DN_per_e, preset.imager.gain_DN_per_e, 1e-12) << name;
    EXPECT_NEAR(made.exposure_s, 3e-4, 1e-18) << name;
    ASSERT_EQ(made.quantum_efficiency.rows(), preset.imager.quantum_efficiency.rows()) << name;
    for (Eigen::Index band = 0; band < 3; ++band) {  // red to blue here, blue to red there
      EXPECT_EQ(made.quantum_efficiency.col(band), preset.imager.quantum_efficiency.col(2 - band)) << name;
    }
  }
}

TEST(CameraPreset, FieldsInTheFileOverrideIt) {
  const CameraSpec camera = camera_with(
      "preset: c310\nwidth: 320\nheight: 240\npixel_pitch_um: 11.2\nrow_time_us: 0\nfull_well_e: 7000\n"
      "exposure_us: 300\n");
  EXPECT_EQ(camera.width, 320);
  EXPECT_EQ(camera.row_time_us, 0.0);
  EXPECT_EQ(camera.full_well_e, 7000.0);
  EXPECT_DOUBLE_EQ(camera.active_area_um2, 11.2 * 11.2);
  EXPECT_EQ(camera.bayer, render::BayerPattern::rggb);
}

TEST(CameraPreset, AnUnknownOneListsTheKnown) {
  EXPECT_THAT(error_of("preset: c920\nexposure_us: 300\n"),
              AllOf(HasSubstr("camera.yaml:5"), HasSubstr("c920"), HasSubstr("imx273, c310, davis240c, adns2620")));
}

TEST(CameraPreset, ItsFrameRateLimitsTheExposure) {
  EXPECT_THAT(error_of("preset: imx273\nexposure_us: 2000\n"),
              AllOf(HasSubstr("camera.yaml:6"), HasSubstr("exposure_us")));
}

TEST(RowTime, MayNotOutlastTheFrame) {
  EXPECT_THAT(error_of("preset: c310\nrow_time_us: 50\nexposure_us: 300\n"),
              AllOf(HasSubstr("camera.yaml:6"), HasSubstr("row_time_us"), HasSubstr("720 rows")));
  EXPECT_THAT(error_of("preset: c310\nrow_time_us: -1\nexposure_us: 300\n"), HasSubstr("camera.yaml:6"));
}

const std::string kDavis = "preset: davis240c\nexposure_us: 300\n";

TEST(EventCamera, ReadsItsFigures) {
  const CameraSpec camera = camera_with(kDavis +
                                        "events: {preset: davis240c, white_1klux_e_per_s: 1e6, on_threshold: 0.15, "
                                        "refractory_us: 20, leak_rate_Hz: 0}\n");
  const render::EventPixelSettings& pixels = camera.events.value().pixels;
  const render::EventPixelSettings davis = render::davis240c(1e6);
  EXPECT_EQ(pixels.on_threshold, 0.15);
  EXPECT_EQ(pixels.off_threshold, davis.off_threshold);
  EXPECT_EQ(pixels.refractory_us, 20);
  EXPECT_EQ(pixels.leak_rate_hz, 0.0);
  EXPECT_EQ(pixels.dark_intensity, davis.dark_intensity);
  EXPECT_EQ(pixels.bandwidth_hz, davis.bandwidth_hz);
  EXPECT_FALSE(camera_with(kDavis).events.has_value());
}

TEST(BinnedCamera, IsReadAndHasNoEventPixels) {
  const std::string binned = "preset: c310\nbayer: binned\nexposure_us: 300\n";
  EXPECT_EQ(camera_with(binned).bayer, render::BayerPattern::binned);
  EXPECT_THAT(error_of(binned + "events: {dark_e_per_s: 10}\n"),
              AllOf(HasSubstr("camera.yaml:8"), HasSubstr("events"), HasSubstr("binned")));
  EXPECT_THAT(error_of("preset: c310\nbayer: bined\nexposure_us: 300\n"),
              AllOf(HasSubstr("camera.yaml:6"), HasSubstr("gbrg"), HasSubstr("binned")));
}

TEST(EventCamera, BadFiguresAreRefusedWithTheirLine) {
  const auto error = [](const std::string& block) { return error_of(kDavis + "events:\n" + block); };
  EXPECT_THAT(error("  dark_e_per_s: 10\n  off_threshold: -0.2\n"),
              AllOf(HasSubstr("camera.yaml:9"), HasSubstr("off_threshold"), HasSubstr("-0.2")));
  EXPECT_THAT(error("  on_threshold: 0.2\n"), HasSubstr("dark_e_per_s"));
  EXPECT_THAT(error("  dark_e_per_s: 10\n  threshold_spread: 0.3\n"), HasSubstr("camera.yaml:9"));
  EXPECT_THAT(error("  dark_e_per_s: 10\n  bandwidth_Hz: 100\n"), HasSubstr("reference_e_per_s"));
  EXPECT_THAT(error("  dark_e_per_s: 10\n  shot_rate_Hz: 1\n"), HasSubstr("shot_half_e_per_s"));
  EXPECT_THAT(error("  dark_e_per_s: 10\n  refractory_us: -1\n"), HasSubstr("camera.yaml:9"));
  EXPECT_THAT(error("  dark_e_per_s: .nan\n"), HasSubstr("camera.yaml:8"));
  EXPECT_THAT(error("  preset: davis240c\n"), HasSubstr("white_1klux_e_per_s"));
  EXPECT_THAT(error("  preset: imx273\n"),
              AllOf(HasSubstr("camera.yaml:8"), HasSubstr("allowed is one of: davis240c")));
  EXPECT_THAT(error("  dark_e_per_s: 10\n  onthreshold: 0.2\n"), HasSubstr("on_threshold"));
}

std::string plan_error(const SceneSpec& scene) {
  try {
    make_plan(scene);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(TimePlan, WhatTheCameraCannotHaveIsRefused) {
  const SceneSpec good = moving_scene("  - {frames: 2, z: {position_mm: 1.9}}\n");
  EXPECT_EQ(plan_error(good), "");

  SceneSpec scene = good;
  scene.outputs.events = true;
  scene.outputs.where = {"scene.yaml", 7};
  scene.device.camera->events.reset();
  EXPECT_THAT(plan_error(scene), AllOf(HasSubstr("scene.yaml:7"), HasSubstr("camera.events")));
  scene.device.camera.reset();
  EXPECT_THAT(plan_error(scene), HasSubstr("no camera"));

  scene = good;
  scene.device.camera->exposure_us = 10001.0;
  EXPECT_THAT(plan_error(scene), AllOf(HasSubstr("10001"), HasSubstr("longer than a frame of the motion")));
  scene.outputs = {.frames = false, .ideal = false};
  EXPECT_EQ(plan_error(scene), "") << "no frames are asked for";

  scene = good;
  scene.effects.rolling_shutter = Switch::on;
  EXPECT_THAT(plan_error(scene), HasSubstr("row_time_us"));

  scene = good;
  scene.device.camera->exposure_us = 0.0;
  scene.effects.motion_blur = Switch::on;
  EXPECT_THAT(plan_error(scene), HasSubstr("exposure_us is 0"));
}

TEST(TimePlan, EventsAloneCallForNoPicture) {
  SceneSpec scene = moving_scene("  - {frames: 2, z: {position_mm: 1}}\n");
  scene.outputs = {.frames = false, .ideal = false};
  scene.outputs.events = true;
  const Plan plan = make_plan(scene);
  EXPECT_TRUE(plan.camera);
  EXPECT_TRUE(plan.events);
  EXPECT_FALSE(plan.motion_blur);
  EXPECT_FALSE(plan.sensor_noise);
  EXPECT_GT(plan.states_a_frame, 1);
  scene.outputs.events = false;
  EXPECT_FALSE(make_plan(scene).camera);
}

}  // namespace
}  // namespace touchstone::sim
