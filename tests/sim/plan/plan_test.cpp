#include "sim/plan/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/message_of.h"

namespace touchstone::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

SceneSpec shipped(const std::string& name) {
  return read_scene(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/vhs" / name);
}

const Effect& effect(const Plan& plan, const std::string& name) {
  for (const Effect& one : plan.effects) {
    if (one.name == name) return one;
  }
  throw std::runtime_error("no effect " + name);
}

TEST(Plan, AStraightPressCallsForNoFriction) {
  EXPECT_FALSE(make_plan(shipped("ball-press.yaml")).friction);
  EXPECT_TRUE(make_plan(shipped("cycle.yaml")).friction);
}

TEST(Plan, ASmoothObjectCallsForNoFriction) {
  SceneSpec scene = shipped("cycle.yaml");
  scene.object.friction = 0.0;
  EXPECT_FALSE(make_plan(scene).friction);
}

TEST(Plan, FiniteStrainIsOnWhereTheSceneAsksForIt) {
  SceneSpec scene = shipped("ball-press.yaml");
  const Plan linear = make_plan(scene);
  EXPECT_FALSE(linear.finite_strain);
  EXPECT_EQ(effect(linear, "finite strain").cost, "nothing");
  scene.effects.elasticity = Elasticity::neo_hookean;
  const Plan plan = make_plan(scene);
  EXPECT_TRUE(plan.finite_strain);
  EXPECT_THAT(effect(plan, "finite strain").why, HasSubstr("the scene asks for"));
  EXPECT_FALSE(plan.relaxation);
  scene.device.gel.relaxation = {{0.2, 1.0}};
  EXPECT_TRUE(make_plan(scene).relaxation);
  scene.motion.keys.front().turn_x.emplace();
  EXPECT_THROW(make_plan(scene), Error) << "torques on a gel that relaxes";
  scene.motion.keys.front().turn_x.reset();
  scene.effects.inertia = Switch::on;
  EXPECT_THROW(make_plan(scene), Error);
}

TEST(Plan, TruthAloneCallsForNoCamera) {
  SceneSpec scene = shipped("cycle.yaml");
  scene.outputs.frames = false;
  const Plan plan = make_plan(scene);
  EXPECT_FALSE(plan.camera);
  EXPECT_EQ(effect(plan, "camera and renderer").cost, "nothing");
}

TEST(Plan, AnImageFromADeviceWithoutACameraIsRefused) {
  SceneSpec scene = shipped("cycle.yaml");
  scene.device.camera.reset();
  try {
    make_plan(scene);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("has no camera"));
    EXPECT_GT(error.where().line, 0);
  }
}

TEST(Plan, AnImageOfAGelThatIsNoSlabIsRefusedAndItsTruthIsnt) {
  SceneSpec scene = shipped("cycle.yaml");
  GelSpec& gel = scene.device.gel;
  for (const auto& shape : std::vector<decltype(gel.shape)>{DomeSpec{}, FingertipSpec{}, GelMeshSpec{}}) {
    gel.shape = shape;
    scene.outputs = {};
    scene.outputs.frames = true;
    try {
      make_plan(scene);
      FAIL() << "no error";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(gel.mesh() ? "is a mesh" : "curved and has no coating"));
      EXPECT_GT(error.where().line, 0);
    }
    scene.outputs.frames = scene.outputs.ideal = scene.outputs.radiance = false;
    EXPECT_FALSE(make_plan(scene).camera);
  }
}

TEST(Plan, FineReliefAndHeightsOfAGelThatIsNeitherFlatNorADomeAreRefused) {
  SceneSpec scene = shipped("cycle.yaml");
  scene.outputs = {};
  scene.outputs.frames = false;
  scene.device.gel.shape = FingertipSpec{};
  scene.effects.fine_relief = Switch::on;
  EXPECT_THAT(test::message_of([&] { make_plan(scene); }),
              AllOf(HasSubstr("cycle.yaml:"), HasSubstr("fine relief is for flat and domed gels"),
                    HasSubstr("effects.fine_relief: off leaves it out")));
  scene.effects.fine_relief = Switch::off;
  EXPECT_EQ(test::message_of([&] { make_plan(scene); }), "no error");
  scene.outputs.height = true;
  EXPECT_THAT(test::message_of([&] { make_plan(scene); }), HasSubstr("outputs.height is for flat"));
}

TEST(Plan, ASwitchOverrulesAndSaysSo) {
  SceneSpec scene = shipped("ball-press.yaml");
  scene.effects.friction = Switch::on;
  const Plan plan = make_plan(scene);
  EXPECT_TRUE(plan.friction);
  EXPECT_THAT(effect(plan, "friction").why, HasSubstr("the scene switches it on"));
}

// Fresnel's number of the vhs hole at 455 nm is 0.05^2 / 455e-6 (1/5 + 1/20.1) = 1.37; a hole of 0.4 mm has 16 times
// that.
TEST(Plan, DiffractionIsHadOnlyWhereItIsAskedForAndCanBe) {
  SceneSpec scene = shipped("ball-press.yaml");
  EXPECT_FALSE(make_plan(scene).diffraction);
  EXPECT_THAT(effect(make_plan(scene), "diffraction").why, HasSubstr("Fresnel's number of the hole is 1.4"));
  scene.effects.diffraction = Switch::on;
  EXPECT_TRUE(make_plan(scene).diffraction);
  EXPECT_TRUE(make_plan(scene).shared_paths);
  scene.outputs = {.frames = false};
  EXPECT_FALSE(make_plan(scene).diffraction);
  scene.outputs = {};
  std::get<PinholeSpec>(scene.device.camera->optics).hole_diameter_um = 400.0;
  EXPECT_THAT(test::message_of([&] { make_plan(scene); }),
              AllOf(HasSubstr("effects.diffraction: on, but Fresnel's number of the hole is 22;"),
                    HasSubstr("up to 12 diffraction is simulated")));
  scene.effects.diffraction = Switch::automatic;
  EXPECT_FALSE(make_plan(scene).diffraction);
  scene = shipped("ball-press.yaml");
  scene.effects.diffraction = Switch::on;
  scene.device.gel.scattering_per_mm = Colour(1.0);
  EXPECT_THAT(test::message_of([&] { make_plan(scene); }), HasSubstr("the gel scatters light"));
}

TEST(Plan, ATighterToleranceCallsForInterreflection) {
  SceneSpec scene = shipped("ball-press.yaml");
  EXPECT_FALSE(make_plan(scene).interreflection);
  scene.light.interreflection_tolerance = 1e-4;
  EXPECT_TRUE(make_plan(scene).interreflection);
}

TEST(Plan, ARoomThatLightsACoatingCallsForInterreflection) {
  SceneSpec scene;
  scene.device = read_yaml<DeviceSpec>(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/devices/gelsight-mini.yaml");
  scene.object.shape.radius_mm = 2.0;
  scene.light.interreflection_tolerance = 0.9;
  EXPECT_TRUE(make_plan(scene).interreflection);
  EXPECT_EQ(effect(make_plan(scene), "interreflection").why, "the room lights the coating");
  scene.device.room_radiance = 0.0;
  EXPECT_FALSE(make_plan(scene).interreflection);
}

// Side lengths are a slab's only; by them a coated dome or fingertip had no size and no light to give itself.
TEST(Plan, ACoatedDomeAndFingertipGiveThemselvesLight) {
  const std::filesystem::path devices = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/devices";
  SceneSpec scene;
  scene.motion.keys = {MotionKey{}};
  scene.effects.fine_relief = Switch::off;
  const auto why = [&](const char* device) {
    scene.device = read_device(devices / device);
    return effect(make_plan(scene), "interreflection").why;
  };
  EXPECT_THAT(why("gelsight-dome.yaml"), HasSubstr("a coating of albedo 0.5 gives itself 1.8 % of its light;"));
  // A hemisphere sends half of its light to itself: 0.02 / (1 - 0.02) = 2.04 %, and 0.01 % come by the plate.
  EXPECT_THAT(why("reflex.yaml"), HasSubstr("a coating of albedo 0.04 gives itself 2.1 % of its light;"));
  EXPECT_FALSE(make_plan(scene).interreflection) << "5 % may be left out";
  scene.light.interreflection_tolerance = 1e-6;
  EXPECT_TRUE(make_plan(scene).interreflection);
}

TEST(Plan, ALuminousProbeReflectsNothing) {
  SceneSpec scene = shipped("cycle.yaml");
  scene.light.interreflection_tolerance = 1e-12;
  EXPECT_FALSE(make_plan(scene).interreflection);
}

TEST(Plan, AGelWithAPronySeriesCallsForRelaxation) {
  SceneSpec scene = shipped("ball-press.yaml");
  EXPECT_FALSE(make_plan(scene).relaxation);
  scene.device.gel.relaxation = {{0.2, 0.1}, {0.1, 5.0}};
  EXPECT_TRUE(make_plan(scene).relaxation);
  EXPECT_THAT(effect(make_plan(scene), "stress relaxation").why, HasSubstr("by 30.0 % in the end"));
  scene.effects.relaxation = Switch::off;
  EXPECT_FALSE(make_plan(scene).relaxation);
  scene.effects.relaxation = Switch::automatic;
  scene.device.gel.relaxation = {{0.0, 0.1}};
  EXPECT_FALSE(make_plan(scene).relaxation);
}

TEST(Plan, AVibrationAboveAFifthOfTheLowestEigenfrequencyCallsForInertia) {
  SceneSpec scene = shipped("vibration.yaml");
  EXPECT_EQ(scene.motion.highest_vibration_Hz(), 100.0);
  const double lowest = 100.0 / std::sqrt(inertia_estimate(scene.device.gel, 100.0));
  EXPECT_NEAR(lowest, 513.5, 0.5) << "sqrt(G/rho)/(4h)";
  EXPECT_FALSE(make_plan(scene).inertia) << "100 Hz is 0.195 of it";
  EXPECT_THAT(effect(make_plan(scene), "gel dynamics (inertia)").why, HasSubstr("3.8 %"));
  scene.motion.keys.back().vibration->frequency_Hz = 0.201 * lowest;
  EXPECT_TRUE(make_plan(scene).inertia);
  scene.motion.keys.back().vibration->amplitude_mm = 0.0;
  EXPECT_FALSE(make_plan(scene).inertia);
  EXPECT_FALSE(make_plan(shipped("cycle.yaml")).inertia);
}

TEST(Plan, AVibrationAlongTheSurfaceCallsForFriction) {
  SceneSpec scene = shipped("vibration.yaml");
  EXPECT_FALSE(make_plan(scene).friction);
  scene.motion.keys.back().vibration->axis = Axis::x;
  EXPECT_TRUE(make_plan(scene).friction);
}

// Under a layer that is thin against the disc nothing gets away sideways, so what comes back at once is the internal
// diffuse reflectance of an index of 1.5, 0.596 (Duntley's formula, as in [Walsh1926]), less the light that the shifts
// of the last grazing angles take away.
TEST(Plan, AWideBrightDiscGetsBackTheDiffuseReflectanceOfTheFace) {
  GelSpec gel;
  gel.thickness_mm = 0.001;
  gel.refractive_index = 1.5;
  const PlateSpec plate{0.001, 1.5};
  const double albedo = 0.5;
  const double expected = albedo * 0.596 / (1.0 - albedo * 0.596);
  EXPECT_NEAR(interreflection_estimate(gel, plate, albedo, 100.0), expected, 0.01 * expected);
}

TEST(Plan, ANarrowDiscGetsBackOnlyWhatFresnelReflectsSteeply) {
  GelSpec gel;
  gel.thickness_mm = 5.0;
  gel.refractive_index = 1.5;
  const PlateSpec plate{2.0, 1.5};
  const double narrow = interreflection_estimate(gel, plate, 0.6, 3.0);
  const double wide = interreflection_estimate(gel, plate, 0.6, 30.0);
  EXPECT_LT(narrow, 0.02) << "beyond the critical angle light comes down 13 mm away or more";
  EXPECT_GT(wide, 5.0 * narrow);
  EXPECT_LT(wide, 0.6 * 0.596 / (1.0 - 0.6 * 0.596)) << "no disc gets back more than an endless one";
}

}  // namespace
}  // namespace touchstone::sim
