#include "sim/cost/scene_cost.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fem/error/setup_estimate.h"
#include "sim/cost/setup_cost.h"
#include "sim/press/gel_setup.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

SceneSpec scene_of(const std::string& name) {
  return read_scene(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes" / (name + ".yaml"));
}

/// Nice numbers.
SceneLook look() {
  SceneLook one;
  one.pressed = true;
  one.states = 2.0;
  one.state_s = 0.01;
  one.newton_parts = 1.5;
  one.moments = 3.0;
  one.relief_s = 0.02;
  one.deepest_relief_s = 0.05;
  one.light = {"direct light", 5.0, 0.1, 0.0};
  one.develop_s = 0.004;
  one.files_s = 0.03;
  return one;
}

MachineRates rates(int threads = 1) {
  return {threads, 1e-10, 1e-6, 1e-5, 2e-5, 1e-9, static_cast<double>(threads)};
}

double frame_s(const SceneCost& cost, const std::string& effect) {
  for (const EffectCost& one : cost.effects) {
    if (one.effect == effect) return one.frame_s;
  }
  return -1.0;
}

Plan plan_of(const SceneSpec& scene) {
  Plan plan = make_plan(scene);
  plan.fine_relief = true;
  plan.motion_blur = true;
  return plan;
}

TEST(SceneCost, AFrameIsItsStatesMomentsAndFiles) {
  const SceneSpec scene = scene_of("gelsight/ball-press");
  const Plan plan = plan_of(scene);
  const SceneCost cost = scene_cost(scene, plan, look(), rates(), 7.0, 0.0, 0.0);
  EXPECT_EQ(cost.frames, scene.motion.frame_count());
  EXPECT_EQ(cost.gel_s, 7.0);
  EXPECT_DOUBLE_EQ(cost.mechanics_s, 2.0 * 0.01);
  EXPECT_DOUBLE_EQ(cost.picture_s, 3.0 * 0.02 + 3.0 * 0.1 + 0.004 + 0.03);
  EXPECT_DOUBLE_EQ(cost.camera_s, 5.0 + 0.05);
  EXPECT_DOUBLE_EQ(frame_s(cost, "fine relief"), 3.0 * 0.02);
  EXPECT_DOUBLE_EQ(frame_s(cost, "direct light"), 0.1);
  EXPECT_DOUBLE_EQ(frame_s(cost, "motion blur"), 2.0 * 0.1);
  EXPECT_TRUE(cost.unknown.empty());
  // Each row is an effect of the plan.
  for (const EffectCost& one : cost.effects) {
    EXPECT_TRUE(std::any_of(plan.effects.begin(), plan.effects.end(), [&](const Effect& effect) {
      return effect.name == one.effect;
    })) << one.effect;
  }
}

TEST(SceneCost, FiniteStrainTakesTheStatesPlace) {
  const SceneSpec scene = scene_of("gelsight/ball-press");
  Plan plan = plan_of(scene);
  plan.finite_strain = true;
  const double once = scene_cost(scene, plan, look(), rates(), 0.0, 1e9, 0.0).mechanics_s;
  EXPECT_DOUBLE_EQ(scene_cost(scene, plan, look(), rates(), 0.0, 2e9, 0.0).mechanics_s, 2.0 * once);
  EXPECT_GT(once, 1.5) << "1.5 parts of some factorisations of a second";
}

TEST(SceneCost, SaysWhatIsNotKnown) {
  SceneSpec scene = scene_of("gelsight/ball-press");
  Plan plan = plan_of(scene);
  plan.events = true;
  SceneLook at_rest = look();
  at_rest.pressed = false;
  const SceneCost cost = scene_cost(scene, plan, at_rest, rates(), std::nullopt, 0.0, 0.0);
  ASSERT_EQ(cost.unknown.size(), 3u);
  EXPECT_THAT(cost.unknown[0], HasSubstr("found by its error"));
  EXPECT_THAT(cost.unknown[1], HasSubstr("gel at rest"));
  EXPECT_THAT(cost.unknown[2], HasSubstr("events"));
}

TEST(SceneCost, ThreadsShareFramesButNotAScenesMotion) {
  const SceneSpec scene = scene_of("gelsight/ball-press");
  const SceneCost one = scene_cost(scene, plan_of(scene), look(), rates(), 7.0, 0.0, 0.0);
  const std::vector<SceneCost> four(4, one);
  const RunCost alone = run_cost(four, rates());
  const RunCost together = run_cost(four, rates(2));
  EXPECT_EQ(alone.frames, 4 * one.frames);
  EXPECT_EQ(alone.gel_s, 7.0) << "scenes of a job have one gel";
  EXPECT_DOUBLE_EQ(alone.frames_s, alone.frames * one.picture_s);
  EXPECT_DOUBLE_EQ(together.frames_s, 0.5 * alone.frames_s);
  EXPECT_DOUBLE_EQ(together.mechanics_s, 0.5 * alone.mechanics_s);
  EXPECT_DOUBLE_EQ(run_cost(std::span(four).first(1), rates(2)).mechanics_s, (one.frames - 1) * one.mechanics_s);
  EXPECT_DOUBLE_EQ(alone.in_all_s(), alone.gel_s + alone.mechanics_s + alone.cameras_s + alone.frames_s);
}

TEST(SceneCost, InWords) {
  RunCost cost;
  cost.gel_s = 30.0;
  cost.cameras_s = 5.0;
  cost.mechanics_s = 24.0;
  cost.frames_s = 192.0;
  cost.frames = 240;
  EXPECT_EQ(in_words(cost), "about 4 min 11 s: 35 s set-up, 240 frames at 0.9 s");
  EXPECT_EQ(seconds_in_words(0.0004), "0.4 ms");
  EXPECT_EQ(seconds_in_words(0.042), "42 ms");
  EXPECT_EQ(seconds_in_words(7260.0), "2 h 01 min");
}

TEST(SceneCost, ALongMotionIsShortened) {
  MotionSpec motion;
  motion.keys.resize(3);
  motion.keys[0].frames = 100;
  motion.keys[1].frames = 300;
  motion.keys[2].frames = 1;
  EXPECT_NEAR(shorten(motion, 40), 401.0 / 41.0, 1e-12);
  EXPECT_EQ(motion.keys[0].frames, 10);
  EXPECT_EQ(motion.keys[1].frames, 30);
  EXPECT_EQ(motion.keys[2].frames, 1);
  EXPECT_EQ(shorten(motion, 41), 1.0);
}

TEST(SetupCost, IsNothingForAGelThatIsKept) {
  const test::TemporaryFolder cache;
  DeviceSpec device = scene_of("gelsight/ball-press").device;
  device.mesh.fine_mm = 1.2;
  device.mesh.coarse_mm = 3.0;
  EXPECT_GT(gel_setup_seconds(device, rates(), cache.path()).value(), 0.0);
  set_up_gel(device, cache.path());
  EXPECT_EQ(gel_setup_seconds(device, rates(), cache.path()), 0.0);
  device.mesh.force_error = 0.01;
  EXPECT_FALSE(gel_setup_seconds(device, rates(), cache.path()));
}

TEST(SetupCost, CountsWhatSetUpReports) {
  DeviceSpec device = scene_of("vhs/ball-press").device;
  device.mesh.fine_mm = 1.0;
  device.mesh.coarse_mm = 2.5;
  const auto gel = set_up_gel(device, {});
  MachineRates count;
  count.elimination_s = 1.0;
  // The ladder's two gels are coarser: together they take less than the gel itself.
  EXPECT_GT(gel_setup_seconds(device, count, {}).value(), gel->report.operations);
  EXPECT_LT(gel_setup_seconds(device, count, {}).value(), 2.0 * gel->report.operations);
  const fem::Compliance unpressed = unpressed_gel(device);
  EXPECT_EQ(unpressed.vertices, gel->vertices);
  EXPECT_EQ(unpressed.triangles, gel->triangles);
}

// The picture's pixels and the frames of a look; seconds are only said to be there.
TEST(SceneLook, SeesWhatAFrameIsMadeOf) {
  const test::TemporaryFolder cache;
  SceneSpec scene = scene_of("gelsight/ball-press");
  scene.device.mesh.fine_mm = 1.0;
  scene.device.mesh.coarse_mm = 3.0;
  scene.device.camera->width = 64;
  scene.device.camera->height = 48;
  scene.device.camera->pixel_pitch_um *= 5.0;
  scene.outputs.depth = true;
  const Plan plan = make_plan(scene);
  const SceneLook rest = look_at_scene(scene, plan, nullptr, cache.path());
  EXPECT_FALSE(rest.pressed);
  EXPECT_EQ(rest.state_s, 0.0);
  EXPECT_GT(rest.light.moment_s, 0.0);
  const auto gel = set_up_gel(scene.device, cache.path());
  const SceneLook pressed = look_at_scene(scene, plan, gel.get(), cache.path());
  EXPECT_TRUE(pressed.pressed);
  EXPECT_EQ(pressed.states, plan.states_a_frame);
  EXPECT_GE(pressed.moments, 1.0);
  for (const double seconds : {pressed.state_s, pressed.relief_s, pressed.light.set_up_s, pressed.light.moment_s,
                               pressed.develop_s, pressed.pixel_truth_s, pressed.files_s}) {
    EXPECT_GT(seconds, 0.0);
  }
  EXPECT_EQ(pressed.height_s, 0.0) << "it isn't asked for";
  EXPECT_EQ(pressed.light.how.substr(0, 12), "direct light");
}

}  // namespace
}  // namespace touchstone::sim
