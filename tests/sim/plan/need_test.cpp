#include "sim/plan/need.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "sim/plan/plan.h"
#include "sim/scene/light_limits.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

SceneSpec shipped(const std::string& name) {
  return read_scene(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/vhs" / name);
}

SceneSpec wanted(const std::string& name, Accuracy accuracy = {}) {
  SceneSpec scene = shipped(name);
  scene.accuracy = AccuracySpec{accuracy.force_percent, accuracy.pixel_noise,   accuracy.marker_px,
                                accuracy.height_um,     accuracy.event_percent, {}};
  return scene;
}

const Effect& effect(const Plan& plan, const std::string& name) {
  for (const Effect& one : plan.effects) {
    if (one.name == name) return one;
  }
  throw std::runtime_error("no effect " + name);
}

TEST(Need, TheScenesAccuracyCountsMoreThanTheDevices) {
  EXPECT_FALSE(accuracy_of({}, {}));
  const AccuracySpec scene{.force_percent = 2.0};
  const AccuracySpec device{.force_percent = 3.0, .pixel_noise = 4.0};
  const Accuracy both = accuracy_of(scene, device).value();
  EXPECT_EQ(both.force_percent, 2.0);
  EXPECT_EQ(both.pixel_noise, 4.0);
  EXPECT_EQ(both.marker_px, 0.05) << "the default";
  EXPECT_EQ(accuracy_of({}, device)->force_percent, 3.0);
}

TEST(Need, AnyUnitAboveWhatIsAllowedCallsForTheEffect) {
  const Accuracy allowed;
  EXPECT_FALSE(exceeds({}, allowed));
  EXPECT_FALSE(exceeds({.force_percent = 1.0, .pixel_noise = 0.9}, allowed)) << "as much may be left out";
  EXPECT_TRUE(exceeds({.force_percent = 0.1, .pixel_noise = 1.1}, allowed));
  EXPECT_TRUE(exceeds({.marker_px = 0.06}, allowed));
  EXPECT_TRUE(exceeds({.height_um = 5.1}, allowed));
  EXPECT_EQ(in_words({}, allowed), "nothing");
  EXPECT_EQ(in_words({.force_percent = 3.21, .height_um = 2.0}, allowed),
            "a force by 3.2 % (allowed 1), heights by 2 um (allowed 5)");
}

TEST(Need, MeasuredChangesDecideWhereAnAccuracyIsStated) {
  const SceneNeeds much = {{"interreflection", Change{.pixel_noise = 5.3}, ""},
                           {"finite strain", Change{.force_percent = 6.0}, ""}};
  const SceneNeeds little = {{"interreflection", Change{.pixel_noise = 0.3}, ""},
                             {"finite strain", Change{.force_percent = 0.6}, ""}};
  const SceneSpec scene = wanted("ball-press.yaml");
  const Plan on = make_plan(scene, much);
  EXPECT_TRUE(on.interreflection);
  EXPECT_TRUE(on.finite_strain);
  EXPECT_THAT(effect(on, "interreflection").why,
              HasSubstr("leaving it out changes pixels by 5.3 of their noise (allowed 1)"));
  const Plan off = make_plan(scene, little);
  EXPECT_FALSE(off.interreflection);
  EXPECT_FALSE(off.finite_strain);
  const Plan unstated = make_plan(shipped("ball-press.yaml"), much);
  EXPECT_FALSE(unstated.finite_strain) << "nobody has said how exact it has to be";
}

TEST(Need, WhatIsMeasuredNearTheAllowedIsTaken) {
  const SceneSpec scene = wanted("ball-press.yaml");
  const Plan near = make_plan(scene, {{"interreflection", Change{.pixel_noise = 0.8}, ""}});
  EXPECT_TRUE(near.interreflection);
  EXPECT_THAT(effect(near, "interreflection").why, HasSubstr("so near to that it is taken"));
  const Plan clear = make_plan(scene, {{"interreflection", Change{.pixel_noise = 1.1}, ""}});
  EXPECT_THAT(effect(clear, "interreflection").why, Not(HasSubstr("so near")));
  EXPECT_FALSE(make_plan(scene, {{"interreflection", Change{.pixel_noise = 0.7}, ""}}).interreflection);
}

TEST(Need, SwitchesCountMoreAndThePlanSaysWhatTheyLeaveOut) {
  SceneSpec scene = wanted("ball-press.yaml");
  scene.effects.interreflection = Switch::off;
  scene.effects.elasticity = Elasticity::linear;
  const SceneNeeds needs = {{"interreflection", Change{.pixel_noise = 5.3}, ""},
                            {"finite strain", Change{.force_percent = 6.0}, ""}};
  const Plan plan = make_plan(scene, needs);
  EXPECT_FALSE(plan.interreflection);
  EXPECT_FALSE(plan.finite_strain);
  EXPECT_THAT(effect(plan, "interreflection").why,
              AllOf(HasSubstr("the scene switches it off"), HasSubstr("by 5.3 of their noise")));
  EXPECT_THAT(effect(plan, "finite strain").why, HasSubstr("a force by 6 %"));
}

TEST(Need, FiniteStrainThatCantBeHadIsLeftOutWithAWarning) {
  SceneSpec scene = wanted("ball-press.yaml");
  scene.more_objects.push_back({scene.object, scene.motion, {}});
  const SceneNeeds needs = {{"finite strain", Change{.force_percent = 6.0}, ""}};
  EXPECT_TRUE(make_plan(scene, needs).finite_strain);
  scene.device.mesh.force_error = 0.01;
  const Plan plan = make_plan(scene, needs);
  EXPECT_FALSE(plan.finite_strain);
  ASSERT_FALSE(plan.warnings.empty());
  EXPECT_THAT(plan.warnings.front(),
              AllOf(HasSubstr("finite strain is left out"), HasSubstr("6 %"), HasSubstr("fine_mm")));
}

TEST(Need, PathsFollowTheAccuracyUnlessTheSceneStatesThem) {
  const LightLimits usual = light_limits(shipped("ball-press.yaml"));
  EXPECT_EQ(usual.noise_fraction, 1.0);
  EXPECT_EQ(usual.min_samples, 32);
  EXPECT_EQ(usual.max_samples, 64);
  EXPECT_EQ(usual.direct_tolerance, 0.015);
  SceneSpec scene = wanted("ball-press.yaml", {.pixel_noise = 0.5});
  const LightLimits exact = light_limits(scene);
  EXPECT_DOUBLE_EQ(exact.noise_fraction, 0.5 * std::sqrt(0.5));
  EXPECT_EQ(exact.max_samples, 256);
  EXPECT_LT(exact.direct_tolerance, 0.015);
  EXPECT_DOUBLE_EQ(exact.direct_noise.value(), exact.noise_fraction);
  EXPECT_FALSE(usual.direct_noise);
  EXPECT_DOUBLE_EQ(light_limits(wanted("ball-press.yaml", {.pixel_noise = 1.0})).direct_tolerance,
                   2.0 * exact.direct_tolerance);
  EXPECT_THAT(
      effect(make_plan(scene, {}), "noise of paths").why,
      AllOf(HasSubstr("32 to 256 paths"), HasSubstr("0.35 of the imager's noise"), HasSubstr("0.5 of the noise")));
  scene.light.max_samples = 16;
  scene.light.noise_fraction = 2.0;
  scene.light.direct_tolerance = 0.2;
  const LightLimits stated = light_limits(scene);
  EXPECT_EQ(stated.max_samples, 16);
  EXPECT_EQ(stated.min_samples, 16);
  EXPECT_EQ(stated.noise_fraction, 2.0);
  EXPECT_EQ(stated.direct_tolerance, 0.2);
  EXPECT_FALSE(stated.direct_noise) << "what the scene states counts";
}

TEST(Need, AMeshThatCantMeetTheAccuracyIsNamedWithTheLeastThereIs) {
  const SceneSpec scene = wanted("ball-press.yaml", {.force_percent = 0.5});
  const Plan plan = make_plan(scene, {{kFinerMesh, Change{.force_percent = 1.7}, ""}});
  ASSERT_FALSE(plan.warnings.empty());
  EXPECT_THAT(plan.warnings.back(), AllOf(HasSubstr("accuracy.force_percent is 0.5"), HasSubstr("off by 1.7 %"),
                                          HasSubstr("edges of 0.5 mm")));
  EXPECT_TRUE(make_plan(scene, {{kFinerMesh, Change{.force_percent = 0.5}, ""}}).warnings.empty());
  EXPECT_TRUE(make_plan(shipped("ball-press.yaml"), {{kFinerMesh, Change{.force_percent = 1.7}, ""}}).warnings.empty());
}

TEST(Need, PathsThatCantMeetTheAccuracyAreNamedWithTheLeastThereIs) {
  SceneSpec scene = wanted("ball-press.yaml");
  scene.effects.shared_paths = Switch::off;
  const SceneNeeds needs = {{kMorePaths, Change{.pixel_noise = 2.0 * std::sqrt(0.5)}, ""}};
  const Plan plan = make_plan(scene, needs);
  ASSERT_FALSE(plan.warnings.empty());
  EXPECT_THAT(plan.warnings.back(), AllOf(HasSubstr("accuracy.pixel_noise is 1"), HasSubstr("leave some 1.4"),
                                          HasSubstr("light.max_samples of 256"), HasSubstr("some 1100")));
  EXPECT_TRUE(make_plan(scene, {{kMorePaths, Change{.pixel_noise = 0.9}, ""}}).warnings.empty());
  scene.light.noise_fraction = 2.0;
  EXPECT_THAT(make_plan(scene, {{kMorePaths, Change{.pixel_noise = 2.0}, ""}}).warnings.back(),
              HasSubstr("light.noise_fraction of 2 leaves more"));
  scene.effects.shared_paths = Switch::automatic;
  EXPECT_TRUE(make_plan(scene, needs).warnings.empty()) << "pixels that share paths have more of them";
}

TEST(Need, ClosedFormsAreHeldBesideTheAccuracy) {
  SceneSpec scene = wanted("ball-press.yaml");
  scene.device.gel.relaxation = {{0.006, 1e-6}};
  EXPECT_FALSE(make_plan(scene).relaxation) << "0.6 % of the modulus fades";
  scene.accuracy->force_percent = 0.5;
  EXPECT_TRUE(make_plan(scene).relaxation);

  SceneSpec vibrating = wanted("vibration.yaml");
  EXPECT_TRUE(make_plan(vibrating).inertia) << "3.8 % of the vibration's force";
  vibrating.accuracy->force_percent = 4.0;
  EXPECT_FALSE(make_plan(vibrating).inertia);

  SceneSpec moving = wanted("cycle.yaml", {.marker_px = 1e-9});
  moving.device.camera->row_time_us = 10.0;
  EXPECT_TRUE(make_plan(moving).motion_blur);
  EXPECT_TRUE(make_plan(moving).rolling_shutter);
  moving.accuracy->marker_px = 1000.0;
  EXPECT_FALSE(make_plan(moving).motion_blur);
  EXPECT_FALSE(make_plan(moving).rolling_shutter);
}

TEST(Need, ATightAccuracyOfPixelsTakesMoreBands) {
  const std::filesystem::path scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
  SceneSpec scene = read_scene(scenes / "chroma/ball-press.yaml");
  scene.device.bands->count.reset();
  scene.accuracy.emplace().pixel_noise = 1e3;
  const int few = make_plan(scene).bands.count();
  scene.accuracy->pixel_noise = 1e-3;
  EXPECT_GT(make_plan(scene).bands.count(), few);
}

TEST(Need, AnAccuracyThatMakesNoSenseIsRefusedByFileAndLine) {
  const std::string scenes = std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/";
  const auto refused = [&](const std::string& block) {
    test::TemporaryFolder folder;
    const auto file = folder.write("scene.yaml", "device: " + scenes + "devices/vhs.yaml\nobject: " + scenes +
                                                     "objects/ball-4mm.yaml\nmotion: " + scenes +
                                                     "motions/press.yaml\naccuracy: " + block + "\n");
    return test::message_of([&] { read_scene(file); });
  };
  for (const char* value : {"0", "-1", ".nan", ".inf", "101"}) {
    EXPECT_THAT(refused(std::string("{force_percent: ") + value + "}"),
                AllOf(HasSubstr("scene.yaml:4"), HasSubstr("accuracy.force_percent"), HasSubstr("100")))
        << value;
  }
  EXPECT_THAT(refused("{pixel_noise: -0.5}"), HasSubstr("accuracy.pixel_noise"));
  EXPECT_THAT(refused("{pixels: 1}"), HasSubstr("pixels"));
  EXPECT_EQ(refused("{marker_px: 0.1, height_um: 2}"), "no error");
}

}  // namespace
}  // namespace touchstone::sim
