// Motion blur and rolling shutter: what a camera makes of motion within a frame.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "sim/plan/image_motion.h"
#include "sim/press/exposure_times.h"
#include "sim/press/play_motion.h"
#include "sim/press/played_states.h"
#include "sim/press/state_between.h"
#include "sim/sensor/virtual_camera.h"
#include "tests/sim/press/moving_scene.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

/// A glowing bar that passes in the air through a dark picture, 40 mm/s to the right; 10 ms a frame.
SceneSpec passing_bar() {
  SceneSpec scene = moving_scene("  - {frames: 2, x: {position_mm: 0.4}}\n");
  scene.object = parse_yaml<ObjectSpec>(
      "name: bar\nshape: {type: box, size_mm: [1, 2.5, 0.5]}\nradiance: [5, 5, 5]\nfriction: 0\n", "object.yaml");
  scene.motion.start_mm = {-0.4, 0.0, 0.5};
  scene.device.lamps.clear();
  scene.device.room_radiance = 0.0;
  scene.device.beads.reset();
  scene.device.camera->exposure_us = 8000.0;
  scene.outputs = {.frames = false, .ideal = false, .radiance = true};
  scene.light.min_samples = scene.light.max_samples = 128;
  scene.light.noise_fraction = 1e-6;
  return scene;
}

cv::Mat green_of(const Capture& capture) {
  cv::Mat green;
  cv::extractChannel(capture.radiance, green, 1);
  return green;
}

struct Films {
  Plan plan;
  std::vector<Truth> truths;
  std::vector<cv::Mat> pictures;  // green band, of the first frames
};

Films film(const SceneSpec& scene, std::size_t frames) {
  Films films;
  films.plan = make_plan(scene);
  films.truths = play_motion(scene, films.plan, *moving_gel());
  const VirtualCamera camera(scene, films.plan, *moving_gel(), films.truths.front());
  for (std::size_t i = 0; i < frames; ++i) {
    films.pictures.push_back(green_of(camera.capture(films.truths[i])));
  }
  return films;
}

/// Sum, mean column and variance over columns of some rows' light.
struct Moments {
  double sum = 0.0, mean = 0.0, variance = 0.0;
  explicit Moments(const cv::Mat& picture) {
    double square = 0.0;
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        const double light = picture.at<float>(y, x);
        sum += light;
        mean += light * (x + 0.5);
        square += light * (x + 0.5) * (x + 0.5);
      }
    }
    mean /= sum;
    variance = square / sum - mean * mean;
  }
};

/// A bar that glows and sticks to the gel, shaken with inertia on: its picture follows its pose without a lag, by as
/// many pixels a mm as when it is led slowly.
TEST(Vibration, PicturesFollowTheShakenBody) {
  const auto seen_at = [](const std::string& keys, std::vector<double>& places_mm) {
    SceneSpec scene = passing_bar();
    scene.device.beads = parse_yaml<DeviceSpec>(kMovingDevice, "device.yaml").beads;  // the gel's modes have them
    scene.object = parse_yaml<ObjectSpec>(
        "name: bar\nshape: {type: box, size_mm: [2, 2, 0.5]}\nradiance: [5, 5, 5]\nfriction: 3\n", "object.yaml");
    scene.motion = parse_yaml<MotionSpec>("start_mm: [0, 0, 0.26]\nframe_rate_Hz: 900\nkeys:\n" + keys, "motion.yaml");
    scene.effects.motion_blur = scene.effects.rolling_shutter = Switch::off;
    scene.light.change_tolerance = 0.0;
    scene.device.camera->exposure_us = 1000.0;
    scene.light.min_samples = scene.light.max_samples = 256;
    if (scene.motion.keys.back().vibration) scene.effects.inertia = Switch::on;
    const Plan plan = make_plan(scene);
    const test::TemporaryFolder cache;
    const auto modes = set_up_vibration(scene, plan, cache.path());
    EXPECT_EQ(modes != nullptr, plan.inertia);
    const std::vector<Truth> truths = play_motion(scene, plan, *moving_gel(), {}, modes.get());
    const VirtualCamera camera(scene, plan, *moving_gel(), truths.front());
    std::vector<double> columns;
    for (const Truth& truth : truths) {
      if (truth.frame < 2) continue;  // it comes down
      places_mm.push_back(truth.press.gel_from_object.translation.x());
      columns.push_back(Moments(green_of(camera.capture(truth))).mean);
    }
    return columns;
  };
  const std::string press = "  - {frames: 2, z: {position_mm: 0.15}}\n";
  std::vector<double> led_mm;
  const std::vector<double> led = seen_at(press + "  - {frames: 2, x: {position_mm: 0.04}}\n", led_mm);
  const double per_mm = (led.back() - led.front()) / (led_mm.back() - led_mm.front());
  ASSERT_GT(per_mm, 2.0);
  std::vector<double> shaken_mm;
  const std::vector<double> shaken =
      seen_at(press + "  - {frames: 9, vibration: {axis: x, amplitude_mm: 0.04, frequency_Hz: 100}}\n", shaken_mm);
  const auto [least, most] = std::minmax_element(shaken_mm.begin(), shaken_mm.end());
  EXPECT_GT(*most - *least, 0.07) << "to and fro in nine frames";
  for (std::size_t i = 0; i < shaken.size(); ++i) {
    EXPECT_NEAR(shaken[i] - shaken[0], per_mm * (shaken_mm[i] - shaken_mm[0]), 0.03 * per_mm * 0.08) << i;
  }
}

TEST(MotionBlur, IsLeftOutWhereTheHoleBlursMore) {
  SceneSpec scene = passing_bar();
  EXPECT_TRUE(make_plan(scene).motion_blur);
  std::get<PinholeSpec>(scene.device.camera->optics).hole_diameter_um = 2000;
  EXPECT_FALSE(make_plan(scene).motion_blur);
  scene.effects.motion_blur = Switch::on;
  EXPECT_TRUE(make_plan(scene).motion_blur);
}

// A disc of diameter d has the variance d^2 / 16 along a line, a pixel 1/12: a disc of 4 pixels is sqrt(13) times as
// wide.
TEST(MotionBlur, PointImagesAreAsWideAsHoleAndPixelMakeThem) {
  DeviceSpec device = passing_bar().device;
  device.gel.refractive_index = device.plate.refractive_index = 1.0;
  device.camera->position_mm = {0, 0, -20};
  auto& pinhole = std::get<PinholeSpec>(device.camera->optics);
  pinhole.hole_to_sensor_mm = 5;
  pinhole.hole_diameter_um = 1e-6;
  EXPECT_NEAR(ImageScale(device).point_width(), 1.0, 1e-9);
  pinhole.hole_diameter_um = 4 * device.camera->pixel_pitch_um / 1.25;  // the shadow of the hole is 1 + 5/20 wide
  EXPECT_NEAR(ImageScale(device).point_width(), std::sqrt(13.0), 1e-9);
}

TEST(MotionBlur, MovesTheMeanByHalfTheTravelAndAddsATwelfthOfItsSquare) {
  const SceneSpec scene = passing_bar();
  const Films blurred = film(scene, 1);
  EXPECT_TRUE(blurred.plan.motion_blur);
  EXPECT_FALSE(blurred.plan.rolling_shutter);
  const ExposureTimes times(scene, blurred.plan);
  const std::vector<double> moments = times.of(blurred.truths[0]);
  EXPECT_EQ(times.window_s(), 0.008);
  EXPECT_GE(moments.size(), 5u);

  // Sharp pictures from begin to end of the exposure.
  SceneSpec sharp = scene;
  sharp.effects.motion_blur = Switch::off;
  const VirtualCamera camera(sharp, make_plan(sharp), *moving_gel(), blurred.truths[0]);
  std::vector<Moments> at;
  double own_variance = 0.0;
  constexpr int kPictures = 6;
  for (int i = 0; i < kPictures; ++i) {
    Truth truth;
    truth.press = state_after(blurred.truths[0], times.window_s() * i / (kPictures - 1));
    at.emplace_back(green_of(camera.capture_whole(truth)));
    own_variance += at.back().variance / kPictures;
  }
  const double travel = at.back().mean - at.front().mean;
  EXPECT_GT(travel, 1.0);
  const Moments with_blur(blurred.pictures[0]);
  EXPECT_NEAR(with_blur.sum / at.front().sum, 1.0, 0.01);
  EXPECT_NEAR(with_blur.mean - at.front().mean, travel / 2, 0.02 * travel);
  // Between moments light runs straight, which blurs by a sixth of their distance's square more.
  const double step = travel / static_cast<double>(moments.size() - 1);
  const double expected = travel * travel / 12 + step * step / 6;
  EXPECT_NEAR(with_blur.variance - own_variance, expected, 0.1 * expected);
}

TEST(MotionBlur, TheLastFrameStandsStill) {
  SceneSpec scene = passing_bar();
  scene.light.min_samples = scene.light.max_samples = 8;
  const Films blurred = film(scene, 3);
  scene.effects.motion_blur = Switch::off;
  const Films sharp = film(scene, 3);
  EXPECT_EQ(cv::norm(blurred.pictures.back(), sharp.pictures.back(), cv::NORM_INF), 0.0);
  EXPECT_TRUE(blurred.truths.back().later.empty());
}

TEST(MotionBlur, WhatIsOffKeepsNoStates) {
  SceneSpec scene = passing_bar();
  scene.effects.motion_blur = Switch::off;
  const Plan plan = make_plan(scene);
  EXPECT_EQ(plan.states_a_frame, 1);
  for (const Truth& truth : play_motion(scene, plan, *moving_gel())) EXPECT_TRUE(truth.later.empty());
}

TEST(MotionBlur, ASlowMotionNeedsNone) {
  SceneSpec scene = passing_bar();
  scene.device.camera->exposure_us = 100.0;
  EXPECT_FALSE(make_plan(scene).motion_blur);
  scene.effects.motion_blur = Switch::on;
  const Plan plan = make_plan(scene);
  EXPECT_TRUE(plan.motion_blur);
  for (const Truth& truth : play_motion(scene, plan, *moving_gel())) {
    EXPECT_TRUE(truth.later.empty()) << "states of a frame in which nothing moves";
  }
}

TEST(RollingShutter, RowsSeeTheMotionAtTheirOwnTime) {
  SceneSpec scene = passing_bar();
  scene.device.camera->exposure_us = 100.0;
  const Films global = film(scene, 2);
  scene.device.camera->row_time_us = 300.0;
  const Films rolling = film(scene, 1);
  EXPECT_TRUE(rolling.plan.rolling_shutter);
  EXPECT_FALSE(rolling.plan.motion_blur);
  const double per_s = (Moments(global.pictures[1]).mean - Moments(global.pictures[0]).mean) / 0.01;
  for (const int row : {11, 15, 19}) {
    const double skew = Moments(rolling.pictures[0].row(row)).mean - Moments(global.pictures[0].row(row)).mean;
    EXPECT_NEAR(skew, per_s * row * 300e-6, 0.05) << "row " << row;
  }
}

TEST(ImageMotion, ABarMovesAsFarAsItsPicture) {
  SceneSpec scene = passing_bar();
  scene.effects.motion_blur = Switch::off;
  const Films sharp = film(scene, 2);
  const double seen = Moments(sharp.pictures[1]).mean - Moments(sharp.pictures[0]).mean;
  const ImageScale scale(scene.device);
  const double bound = image_motion(scale, sharp.truths[0].press, sharp.truths[1].press, largest_object_radius(scene));
  EXPECT_GE(bound, seen) << "an estimate from above";
  EXPECT_LT(bound, 1.2 * seen);
  EXPECT_NEAR(motion_speed(scene).pixels_per_s, 100.0 * bound, 1e-6 * bound);
}

TEST(ImageMotion, ATorqueTurnsAsFastAsThePlanSays) {
  SceneSpec scene = moving_scene("  - {frames: 4, z: {force_N: 0.5}}\n  - {frames: 2, turn_y: {torque_Nmm: 0.2}}\n");
  scene.object.friction = 0.5;
  scene.device.camera->exposure_us = 8000.0;
  SceneSpec still = scene;
  still.motion.keys.pop_back();
  const MotionSpeed speed = motion_speed(scene);
  EXPECT_GT(speed.pixels_per_s, 1.5 * motion_speed(still).pixels_per_s);
  EXPECT_TRUE(speed.led_by_force);
  EXPECT_TRUE(make_plan(scene).motion_blur);
  scene.effects.motion_blur = Switch::off;
  const std::vector<Truth> truths = play_motion(scene, make_plan(scene), *moving_gel());
  const ImageScale scale(scene.device);
  const double turned =
      image_motion(scale, truths[truths.size() - 2].press, truths.back().press, largest_object_radius(scene));
  EXPECT_GT(turned, 0.1) << "it does turn";
  EXPECT_LE(turned * scene.motion.frame_rate_Hz, speed.pixels_per_s);
}

TEST(StateBetween, IsNearWhatIsPlayedThere) {
  SceneSpec scene = moving_scene("  - {frames: 4, z: {position_mm: 1.8}}\n");
  scene.outputs = {.frames = false, .ideal = false};
  scene.outputs.events = true;
  Plan plan = make_plan(scene);
  constexpr int kFiner = 4;
  const int kept = plan.states_a_frame;
  const double travel = 0.05 / kept;  // of the ball from one kept state to the next
  EXPECT_LE(travel, 0.02);
  plan.states_a_frame *= kFiner;
  std::vector<fem::PressState> states;
  play_states(scene, plan, *moving_gel(), nullptr, {},
              [&](int, int, const fem::PressState& state) { states.push_back(state); });
  ASSERT_EQ(static_cast<int>(states.size()), 1 + 4 * kept * kFiner);
  double worst = 0.0;
  for (std::size_t f = 0; f + kFiner < states.size(); f += kFiner) {
    for (std::size_t k = 1; k < kFiner; ++k) {
      const fem::PressState state = state_between(states[f], states[f + kFiner], static_cast<double>(k) / kFiner);
      const fem::PressState& played = states[f + k];
      EXPECT_NEAR(state.gel_from_object.translation.z(), played.gel_from_object.translation.z(), 1e-12);
      worst = std::max(worst, (state.surface_displacement - played.surface_displacement).cwiseAbs().maxCoeff());
    }
  }
  // A vertex that is met in between stands still first and then goes with the ball, which a straight line misses by at
  // most a quarter of the motion; the projection on hat functions, which the displacement is, overshoots that.
  EXPECT_LT(worst, travel / 2);
  EXPECT_GT(worst, 0.0);
}

}  // namespace
}  // namespace touchstone::sim
