#include "sim/need/scene_needs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/whole_file.h"
#include "sim/press/gel_setup.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

const test::TemporaryFolder& cache() {
  static const test::TemporaryFolder folder;
  return folder;
}

/// A ball of 4 mm, 1 mm deep into a slab of 5 mm, seen through it; the mesh is coarse.
SceneSpec small_scene() {
  SceneSpec scene = read_scene(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/vhs/ball-press.yaml");
  scene.device.beads.reset();
  scene.device.mesh.fine_mm = 0.8;
  scene.device.mesh.coarse_mm = 2.0;
  scene.device.camera->width = 160;
  scene.device.camera->height = 120;
  scene.device.camera->pixel_pitch_um *= 4.0;
  return scene;
}

constexpr NeedSettings kLinear{.finite_edges = 0.0};

SceneNeeds needs_of(const SceneSpec& scene, const NeedSettings& settings = kLinear) {
  return measure_needs(scene, *set_up_gel(scene.device, cache().path()), settings, cache().path());
}

TEST(SceneNeeds, WhatReflectsNothingCallsForNoInterreflection) {
  SceneSpec scene = small_scene();
  scene.device.gel.frame_albedo = 0.0;
  scene.object.albedo = 0.0;
  EXPECT_LT(*change_of(needs_of(scene), "interreflection")->pixel_noise, 0.05);
  EXPECT_GT(*change_of(needs_of(small_scene()), "interreflection")->pixel_noise, 1.0);
}

// Events are changes of log light: light that is added dims the contrast of a dent.
TEST(SceneNeeds, EventsAreJudgedByTheContrastThatMakesThem) {
  SceneSpec scene = small_scene();
  scene.outputs = {.frames = false, .events = true};
  scene.device.camera->events.emplace().pixels.dark_intensity = 1e4;
  const Change bright = *change_of(needs_of(scene), "interreflection");
  EXPECT_FALSE(bright.pixel_noise) << "no picture is asked for";
  EXPECT_GT(bright.event_percent.value(), 1.0);
  scene.device.gel.frame_albedo = 0.0;
  scene.object.albedo = 0.0;
  EXPECT_LT(change_of(needs_of(scene), "interreflection")->event_percent.value(), 0.1 * *bright.event_percent);
  EXPECT_TRUE(exceeds({.event_percent = 5.1}, Accuracy{}));
}

// A second object counts as the first one does, also where that one touches nothing.
TEST(SceneNeeds, OfSeveralObjectsCountTheOneThatIsPressed) {
  SceneSpec scene = small_scene();
  scene.outputs = {.frames = false};
  const double alone = change_of(needs_of(scene, {}), "finite strain")->force_percent.value();
  scene.more_objects.push_back({scene.object, scene.motion, {}});
  scene.motion.start_mm.z() += 3.0;
  for (MotionKey& key : scene.motion.keys) key = {.frames = key.frames};
  const double second = change_of(needs_of(scene, {}), "finite strain")->force_percent.value();
  EXPECT_NEAR(second, alone, 0.1 * alone);
}

// What the coating and the housing throw back lights the whole pad, pressed or not; a background recorded of the unit
// has it already, so only what a dent changes of it is left to leave out.
TEST(SceneNeeds, ABackgroundGivesBackWhatIsMissingAtRest) {
  SceneSpec scene = read_scene(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/gelsight/ball-drag-mini.yaml");
  scene.device =
      read_yaml<DeviceSpec>(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/devices/gelsight-mini.yaml");
  scene.device.mesh.fine_mm = 1.0;
  scene.device.mesh.coarse_mm = 2.5;
  scene.motion.keys.resize(1);
  ASSERT_FALSE(scene.device.background.empty());
  const double with = *change_of(needs_of(scene), "interreflection")->pixel_noise;
  scene.device.background = cv::Mat();
  const double without = *change_of(needs_of(scene), "interreflection")->pixel_noise;
  EXPECT_LT(with, 0.1 * without);
}

// A punch sticking to a half space of nu = 0.3 is stiffer than one that slides by (1 - nu) log(3 - 4 nu) / (1 - 2 nu),
// 2.9 % (the bonded punch of [Johnson1985, sec. 3.8]); on a layer it is of that order.
TEST(SceneNeeds, FrictionOfAStraightPressIsMeasured) {
  SceneSpec scene = small_scene();
  scene.outputs = {.frames = false};
  scene.device.gel.poisson_ratio = 0.3;
  scene.object = read_yaml<ObjectSpec>(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/objects/punch-2mm.yaml");
  scene.object.friction = 50.0;
  scene.motion.start_mm.z() = 0.1;
  scene.motion.keys.resize(1);
  scene.motion.keys.front().z = AxisKey{.position_mm = -0.2};
  const double wanted = 100.0 * (0.7 * std::log(1.8) / 0.4 - 1.0);
  const SceneNeeds needs = needs_of(scene);
  EXPECT_GT(*change_of(needs, "friction")->force_percent, 0.5 * wanted);
  EXPECT_LT(*change_of(needs, "friction")->force_percent, 2.0 * wanted);
  EXPECT_FALSE(change_of(needs, "friction")->pixel_noise) << "no picture is asked for";
  EXPECT_EQ(change_of(needs, "interreflection"), nullptr);
  scene.accuracy.emplace();
  EXPECT_TRUE(make_plan(scene, needs).friction) << "though the motion has no tangential part";
  scene.object.friction = 0.0;
  EXPECT_EQ(*change_of(needs_of(scene), "friction")->force_percent, 0.0);
}

TEST(SceneNeeds, DeeperPressesCallForFiniteStrain) {
  SceneSpec scene = small_scene();
  scene.outputs = {.frames = false};
  const double deep = change_of(needs_of(scene, {}), "finite strain")->force_percent.value();
  for (MotionKey& key : scene.motion.keys) {
    if (key.z && key.z->force_N) key.z->force_N = *key.z->force_N * 0.1;
  }
  const double shallow = change_of(needs_of(scene, {}), "finite strain")->force_percent.value();
  EXPECT_LT(shallow, 0.5 * deep);
}

TEST(SceneNeeds, AreTheSameEachTimeAndKept) {
  SceneSpec scene = small_scene();
  scene.outputs = {.frames = false};
  scene.motion.keys.resize(1);
  scene.motion.keys.front() = {.frames = 1, .z = AxisKey{.position_mm = 1.6}};
  scene.device.mesh.fine_mm = 1.2;
  scene.accuracy.emplace();
  const test::TemporaryFolder folder;
  const auto whys = [](const Plan& plan) {
    std::string all;
    for (const Effect& effect : plan.effects) all += effect.name + ": " + effect.why + "\n";
    return all;
  };
  const std::string first = whys(plan_by_need(scene, "key", folder.path()));
  EXPECT_THAT(first, HasSubstr("leaving it out changes"));
  EXPECT_THAT(first, HasSubstr("finite strain: the gel is stretched"));
  EXPECT_EQ(first, whys(plan_by_need(scene, "", cache().path()))) << "measured anew";
  std::filesystem::path kept;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.path().filename().string().starts_with("need-")) kept = entry.path();
  }
  ASSERT_FALSE(kept.empty());
  EXPECT_EQ(first, whys(plan_by_need(scene, "key", folder.path()))) << "read back";
  for (const char* damage : {"", "[", "{}", "[{}]", "[{\"effect\": 1}]",
                             "[{\"effect\": \"friction\", \"note\": \"\", \"change\": {\"force_percent\": -1}}]"}) {
    write_whole_file(kept, damage);
    EXPECT_EQ(first, whys(plan_by_need(scene, "key", folder.path()))) << damage;
  }
}

TEST(SceneNeeds, NothingIsMeasuredWhereNoAccuracyIsStated) {
  const SceneSpec scene = small_scene();
  const test::TemporaryFolder folder;
  plan_by_need(scene, "key", folder.path());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace touchstone::sim
