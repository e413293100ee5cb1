#include "lab/reflex/reflex_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "lab/reflex/reflex_record.h"
#include "render/imager/motion_chip.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"
#include "tests/support/message_of.h"

namespace touchstone::lab {
namespace {

using ::touchstone::test::message_of;

sim::DeviceSpec device() {
  sim::DeviceSpec device = sim::read_device(TOUCHSTONE_SOURCE_DIR "/scenes/devices/reflex.yaml");
  device.mesh.fine_mm = 1.6;  // the skin as seen is finer
  return device;
}

/// The device's skin without mechanics: what a plate would press in is laid onto it.
class Skin {
 public:
  Skin() : gel_(sim::set_up_finite_gel(device())), visible_(visible_skin(*gel_, sim::gel_body(device()))) {}

  sim::GelSheet pressed(double depth_mm, double aside_mm = 0.0) const {
    const auto n = static_cast<Eigen::Index>(gel_->outer.mesh_vertex.size());
    fem::PressState press;
    press.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
    press.node_state.assign(static_cast<std::size_t>(n), fem::NodeState::open);
    press.gel_from_object.translation = {0, 0, depth_mm > 0.0 ? -depth_mm : 10.0};
    for (Eigen::Index i = 0; i < n; ++i) {
      const double z = gel_->mesh.vertices[static_cast<std::size_t>(gel_->outer.mesh_vertex[i])].z();
      press.surface_displacement(i, 0) = aside_mm * std::exp(0.25 * z);
      if (z <= -depth_mm || depth_mm <= 0.0) continue;
      press.surface_displacement(i, 2) = -depth_mm - z;
      press.node_state[i] = fem::NodeState::stick;
    }
    return skin_sheet(visible_, press, fem::BoxShape{{60, 60, 1e-3}});
  }

 private:
  std::shared_ptr<const fem::FiniteGel> gel_;
  sim::VisibleGel visible_;
};

const Skin& skin() {
  static const Skin one;
  return one;
}

ReflexLight light_of(const sim::DeviceSpec& of, const ReflexLightSettings& settings = {}) {
  const std::vector<sim::GelSheet> reached = {skin().pressed(5.0), skin().pressed(0, 2.0), skin().pressed(0, -2.0)};
  return ReflexLight(of, skin().pressed(0), reached, settings);
}

const ReflexLight& light() {
  static const ReflexLight one = light_of(device());
  return one;
}

/// What the chip makes of a steady light.
render::ChipFrame shown(const ReflexLight& of, const cv::Mat& irradiance, bool automatic = true) {
  render::MotionChipSettings settings = sim::motion_chip(of.device(), of.bands(), true);
  settings.shutter.automatic = automatic;
  render::MotionChip chip(settings, 1, 2);
  render::ChipFrame frame = chip.expose(irradiance);
  for (int k = 0; k < 80; ++k) frame = chip.expose(irradiance);
  return frame;
}

/// Direct light against path tracing, on the chip's own pixels: what their noises have not in common.
TEST(ReflexLight, IsWhatPathTracingGives) {
  for (const double depth : {0.0, 4.0}) {
    const sim::GelSheet sheet = skin().pressed(depth);
    const cv::Mat drawn = light().irradiance(sheet);
    const cv::Mat one = light().traced(sheet, 400, 11);
    const cv::Mat other = light().traced(sheet, 400, 12);
    const cv::Mat off_one = drawn - one;
    const cv::Mat off_other = drawn - other;
    const double squares = off_one.dot(off_other) / drawn.dot(drawn);
    RecordProperty(depth > 0 ? "pressed" : "rest", std::to_string(std::sqrt(std::max(0.0, squares))));
    EXPECT_LT(squares, 0.02 * 0.02) << depth;
    EXPECT_NEAR(cv::mean(drawn)[0] / cv::mean(one)[0], 1.0, 0.02) << depth;
  }
  EXPECT_LT(std::abs(light().error().mean), 0.02);  // of parts of pixels: 16 rays on dots' rims scatter by 7 %
}

TEST(ReflexLight, ThePressedSkinIsLargerAndBrighter) {
  const ChipStatistics rest = shown(light(), light().irradiance(skin().pressed(0))).statistics;
  const ChipStatistics touched = shown(light(), light().irradiance(skin().pressed(1))).statistics;
  const ChipStatistics deep = shown(light(), light().irradiance(skin().pressed(4))).statistics;
  // The tree of [Knoop2013] splits at MAX 38 and 40 of 63.
  EXPECT_GT(rest.maximum, 30);
  EXPECT_LT(rest.maximum, 42);
  EXPECT_GT(touched.maximum, rest.maximum);
  EXPECT_GT(deep.maximum, touched.maximum + 5);
  EXPECT_GT(deep.average, rest.average);
  EXPECT_LE(deep.maximum, 62);
  EXPECT_LT(rest.minimum, 5);  // black skin
}

/// Too dark for the shutter's range, it stays at the longest exposure: so numbers tell the light.
TEST(ReflexLight, TheShutterStaysAtItsLongest) {
  const int rest = shown(light(), light().irradiance(skin().pressed(0))).shutter;
  EXPECT_EQ(rest, 14880);  // 620 us of 24 MHz
  EXPECT_EQ(shown(light(), light().irradiance(skin().pressed(4))).shutter, rest);
}

TEST(ReflexLight, WhatMovesRightIsSeenToMoveRight) {
  render::MotionChip chip(sim::motion_chip(light().device(), light().bands(), true), 1, 2);
  int dx = 0;
  int dy = 0;
  for (int k = 0; k <= 16; ++k) {
    const ChipStatistics statistics = chip.expose(light().irradiance(skin().pressed(2.0, k / 16.0))).statistics;
    dx += statistics.dx;
    dy += statistics.dy;
  }
  // 1 mm at the apex, less beside it; a pixel is some 0.45 mm there.
  EXPECT_GE(dx, 1);
  EXPECT_LE(dx, 3);
  EXPECT_EQ(dy, 0);
}

TEST(ReflexLight, BadLightIsDrawnWhenAskedFor) {
  const sim::GelSheet rest = skin().pressed(0);
  ReflexLightSettings off;
  off.lamp_level = 0.0;
  const ReflexLight dark = light_of(device(), off);
  const ChipStatistics black = shown(dark, dark.irradiance(rest)).statistics;
  EXPECT_LE(black.maximum, 2);
  EXPECT_EQ(black.squal, 0);
  ReflexLightSettings glaring;
  glaring.lamp_level = 100.0;
  const ReflexLight bright = light_of(device(), glaring);
  const cv::Mat much = bright.irradiance(rest);
  EXPECT_NEAR(cv::mean(much)[0] / cv::mean(light().irradiance(rest))[0], 100.0, 1.0);
  const ChipStatistics white = shown(bright, much, false).statistics;
  EXPECT_EQ(white.maximum, 63);
  EXPECT_GT(white.average, 55);
  sim::DeviceSpec bare = device();
  bare.coating->print.reset();
  const ReflexLight plain = light_of(bare);
  const ChipStatistics empty = shown(plain, plain.irradiance(rest)).statistics;
  EXPECT_LT(empty.maximum, 6);
  EXPECT_LT(empty.squal, render::kLeastFeatures);
}

TEST(ReflexLight, SameBytesOnAnyNumberOfThreads) {
  const sim::GelSheet sheet = skin().pressed(1.5);
  const cv::Mat all = light().irradiance(sheet);
  cv::Mat alone;
  tbb::task_arena(1).execute([&] { alone = light_of(device()).irradiance(sheet); });
  EXPECT_EQ(cv::norm(all, alone, cv::NORM_INF), 0.0);
}

TEST(ReflexLight, BadInputIsRefused) {
  const sim::GelSheet rest = skin().pressed(0);
  const std::vector<sim::GelSheet> reached = {rest};
  sim::DeviceSpec bad = device();
  bad.camera.reset();
  EXPECT_THAT(message_of([&] { ReflexLight(bad, rest, reached); }), testing::HasSubstr("camera"));
  bad = device();
  bad.coating.reset();
  EXPECT_THAT(message_of([&] { ReflexLight(bad, rest, reached); }), testing::HasSubstr("coating"));
  bad = device();
  bad.lamps.clear();
  EXPECT_THAT(message_of([&] { ReflexLight(bad, rest, reached); }), testing::HasSubstr("no lamps"));
  bad = device();
  bad.lamps.front().count = 65;  // more beams than a direct renderer takes
  EXPECT_THAT(message_of([&] { ReflexLight(bad, rest, reached); }),
              testing::HasSubstr("65 beams of 65 lamps; at most 64"));
  ReflexLightSettings settings;
  settings.rays = 65;
  EXPECT_THAT(message_of([&] { ReflexLight(device(), rest, reached, settings); }), testing::HasSubstr("65"));
  EXPECT_THAT(message_of([&] { ReflexLight(device(), rest, {}); }), testing::HasSubstr("reach"));
  EXPECT_THAT(message_of([&] { light().irradiance(skin().pressed(0, 4.0)); }), testing::HasSubstr("beyond"));
}

}  // namespace
}  // namespace touchstone::lab
