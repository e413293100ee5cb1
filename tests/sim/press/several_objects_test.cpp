// Scenes of several objects.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/whole_file.h"
#include "sim/plan/plan.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/scene.h"
#include "sim/view/scene_view.h"
#include "sim/view/visible_scene.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

const char* const kDevice = R"(name: wide
gel: {size_x_mm: 14, size_y_mm: 8, thickness_mm: 2, youngs_modulus_MPa: 0.3, poisson_ratio: 0.45}
mesh: {fine_mm: 0.5, coarse_mm: 1.5, fine_half_extent_mm: [6, 1.5], fine_depth_mm: 0.5}
plate: {thickness_mm: 1, refractive_index: 1.5}
)";

/// A folder with a device, a ball and two motions of 3 frames, and a scene of two balls.
class SeveralObjects : public ::testing::Test {
 protected:
  void SetUp() override {
    write("device.yaml", kDevice);
    write("ball.yaml", "name: ball\nshape: {type: sphere, radius_mm: 2}\nfriction: 0.4\n");
    write("press.yaml", "start_mm: [0, 0, 2.1]\nkeys:\n  - {frames: 2, z: {position_mm: 1.8}}\n");
    write("slower.yaml", "start_mm: [0, 0, 2.1]\nkeys:\n  - {frames: 1}\n  - {frames: 1, z: {position_mm: 1.85}}\n");
    write("long.yaml", "start_mm: [0, 0, 2.1]\nkeys:\n  - {frames: 5, z: {position_mm: 1.8}}\n");
    write("fast.yaml", "start_mm: [0, 0, 2.1]\nframe_rate_Hz: 50\nkeys:\n  - {frames: 2, z: {position_mm: 1.8}}\n");
    write(
        "shear.yaml",
        "start_mm: [0, 0, 2.1]\nkeys:\n  - {frames: 1, z: {position_mm: 1.8}}\n  - {frames: 1, x: {position_mm: 3}}\n");
  }
  void write(const std::string& name, const std::string& text) const { write_whole_file(folder_.path() / name, text); }
  SceneSpec scene(double x, const std::string& more = "") const {
    write("scene.yaml", fmt::format("device: device.yaml\nobject: ball.yaml\nmotion: press.yaml\n"
                                    "start_mm: [{}, 0, 2.1]\noutputs: {{frames: false}}\n{}",
                                    x, more));
    return read_scene(folder_.path() / "scene.yaml");
  }
  static std::string one_more(double x, const std::string& motion) {
    return fmt::format("more_objects:\n  - {{object: ball.yaml, motion: {}, start_mm: [{}, 0, 2.1]}}\n", motion, x);
  }
  std::string error_of(const std::string& more) const {
    try {
      scene(0.0, more);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  static std::vector<Truth> play(const SceneSpec& spec) {
    static const test::TemporaryFolder cache;
    const auto gel = set_up_gel(spec.device, cache.path());
    const Plan plan = make_plan(spec);
    return play_motion(spec, plan, *gel, {}, nullptr, set_up_elastic_objects(spec, plan, cache.path()));
  }

  test::TemporaryFolder folder_;
};

TEST_F(SeveralObjects, FarApartAreAsIfAlone) {
  const SceneSpec left = scene(-5.0);
  SceneSpec right = scene(5.0);
  right.motion = scene(-5.0, one_more(5.0, "slower.yaml")).more_objects.front().motion;
  const auto first = play(left);
  const auto second = play(right);
  const auto both = play(scene(-5.0, one_more(5.0, "slower.yaml")));
  ASSERT_EQ(both.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(both[i].press.bodies.size(), 2u);
    const double left_force = first[i].press.wrench[2];
    const double right_force = second[i].press.wrench[2];
    EXPECT_NEAR(both[i].press.bodies[0].wrench[2], left_force, 0.02 * left_force);
    EXPECT_NEAR(both[i].press.bodies[1].wrench[2], right_force, 0.02 * right_force);
    EXPECT_EQ(both[i].press.bodies[0].wrench, both[i].press.wrench);
  }
  EXPECT_GT(both[2].press.bodies[1].wrench[2], 0.01);
  EXPECT_GT(both[2].press.bodies[0].wrench[2], both[2].press.bodies[1].wrench[2]) << "it goes deeper";
  EXPECT_EQ(both[2].press.bodies[1].gel_from_object.translation, Eigen::Vector3d(5, 0, 1.85));
}

TEST_F(SeveralObjects, CloseTogetherFeelEachOther) {
  // On a thick gel, where each lies in the other's dent; a thin one bulges beside a dent.
  std::string thick = kDevice;
  thick.replace(thick.find("thickness_mm: 2"), 15, "thickness_mm: 6");
  write("device.yaml", thick);
  const double alone = play(scene(-1.1)).back().press.wrench[2];
  const auto pair = play(scene(-1.1, one_more(1.1, "press.yaml")));
  EXPECT_LT(pair.back().press.wrench[2], 0.97 * alone);
  EXPECT_NEAR(pair.back().press.bodies[1].wrench[2], pair.back().press.wrench[2], 0.03 * alone);
}

TEST_F(SeveralObjects, AnyTangentialOneCallsForFriction) {
  EXPECT_FALSE(make_plan(scene(0.0, one_more(2.0, "press.yaml"))).friction);
  const SceneSpec sheared = scene(-3.0, one_more(2.5, "shear.yaml"));
  EXPECT_TRUE(make_plan(sheared).friction);
  const auto truths = play(sheared);
  EXPECT_GT(std::abs(truths.back().press.bodies[1].wrench[0]), 0.1 * truths.back().press.bodies[1].wrench[2]);
  EXPECT_LT(std::abs(truths.back().press.wrench[0]), 0.05 * truths.back().press.wrench[2]);
}

TEST_F(SeveralObjects, ArePressedAtFiniteStrain) {
  const std::string large = "effects: {elasticity: neo_hookean}\n";
  const double left = play(scene(-5.0, large)).back().press.wrench[2];
  const auto both = play(scene(-5.0, one_more(5.0, "slower.yaml") + large));
  const auto linear = play(scene(-5.0, one_more(5.0, "slower.yaml")));
  ASSERT_EQ(both.size(), 3u);
  EXPECT_NEAR(both.back().press.bodies[0].wrench[2], left, 0.02 * left);
  for (int b = 0; b < 2; ++b) {
    const double force = both.back().press.bodies[b].wrench[2];
    EXPECT_GT(force, 0.01);
    EXPECT_NEAR(force, linear.back().press.bodies[b].wrench[2], 0.2 * force);
  }
}

TEST_F(SeveralObjects, AreTurnedByTorquesAtFiniteStrain) {
  const std::string start = "start_mm: [0, 0, 2.1]\nkeys:\n  - {frames: 2, z: {force_N: 0.2}}\n  - {frames: 2";
  write("press.yaml", start + ", turn_x: {torque_Nmm: 0}, turn_y: {torque_Nmm: 0}}\n");
  write("slower.yaml", start + "}\n");
  const SceneSpec spec =
      scene(-4.0, one_more(4.0, "slower.yaml") + "effects: {elasticity: neo_hookean, friction: on}\n");
  const auto truths = play(spec);
  const fem::PressState& state = truths.back().press;
  EXPECT_LT(state.torque_residual, 1e-5);
  EXPECT_NEAR(state.bodies[0].wrench[2], 0.2, 1e-6);
  EXPECT_NEAR(state.bodies[1].wrench[2], 0.2, 1e-6);
  EXPECT_EQ(state.bodies[1].gel_from_object.rotation, Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
}

TEST_F(SeveralObjects, MayBeElasticOrRigid) {
  write("soft.yaml",
        "name: soft\nshape: {type: sphere, radius_mm: 2}\n"
        "elastic: {youngs_modulus_MPa: 0.03, poisson_ratio: 0.3, mesh_mm: 0.6}\n");
  const SceneSpec spec =
      scene(-5.0, "more_objects:\n  - {object: soft.yaml, motion: press.yaml, start_mm: [5, 0, 2.1]}\n");
  const auto truths = play(spec);
  EXPECT_GT(truths.back().press.bodies[1].wrench[2], 0.0);
  EXPECT_LT(truths.back().press.bodies[1].wrench[2], 0.4 * truths.back().press.wrench[2]);
}

TEST_F(SeveralObjects, OfOtherLengthsOrRatesAreRefused) {
  EXPECT_THAT(error_of(one_more(2.0, "long.yaml")),
              HasSubstr("scene.yaml:7: more_objects: the motion has 6 frames, that of the first object 3"));
  EXPECT_THAT(error_of(one_more(2.0, "fast.yaml")), HasSubstr("scene.yaml:7: more_objects: the motion has 50 frames"));
  EXPECT_THAT(error_of(one_more(2.0, "nowhere.yaml")),
              HasSubstr("scene.yaml:7: more_objects[0]: motion: there is no file"));
  EXPECT_THAT(error_of("more_objects:\n  - {object: ball.yaml}\n"), HasSubstr("scene.yaml:7"));
  EXPECT_EQ(error_of(one_more(2.0, "press.yaml")), "");
}

TEST_F(SeveralObjects, HaveNoFineReliefAndNoInertia) {
  const auto plan_error = [](SceneSpec spec, Switch EffectSwitches::*effect) {
    spec.effects.*effect = Switch::on;
    try {
      make_plan(spec);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const SceneSpec spec = scene(0.0, one_more(2.0, "press.yaml"));
  EXPECT_THAT(plan_error(spec, &EffectSwitches::fine_relief), HasSubstr("fine relief isn't simulated with several"));
  EXPECT_THAT(plan_error(spec, &EffectSwitches::inertia), HasSubstr("inertia isn't simulated with several"));
}

// Each skin's colour follows its own pressure, whose sum over the face is the force.
TEST(SkinsOfSeveralObjects, FadeWhereTheyArePressed) {
  const std::string skin =
      "shape: {type: sphere, radius_mm: 4}\nalbedo: 0.8\nprint:\n  - {type: skin, patches: [{kind: erythema, "
      "centre_mm: "
      "[0, 0], diameter_mm: 1, colour: 0.4}, {kind: purpura, centre_mm: [0.9, 0], diameter_mm: 0.5, rim_mm: 0, colour: "
      "0.3}]}\n";
  SceneSpec spec;
  spec.device = test::small_device();
  spec.object = parse_yaml<ObjectSpec>("name: pressed\n" + skin, "pressed.yaml");
  spec.motion =
      parse_yaml<MotionSpec>("start_mm: [-1, 0, 4.05]\nkeys:\n  - {frames: 3, z: {position_mm: 3.7}}\n", "m.yaml");
  spec.more_objects.push_back({parse_yaml<ObjectSpec>("name: idle\n" + skin, "idle.yaml"),
                               parse_yaml<MotionSpec>("start_mm: [4, 0, 6]\nkeys:\n  - {frames: 3}\n", "n.yaml"),
                               {}});
  const Plan plan = make_plan(spec);
  ASSERT_TRUE(plan.skin_blanching);
  const test::TemporaryFolder cache;
  const auto gel = set_up_gel(spec.device, cache.path());
  const std::vector<Truth> truths = play_motion(spec, plan, *gel);
  const VisibleGel visible(*gel, gel_body(spec.device));
  const std::vector<VisibleObject> objects = visible_objects(spec);

  const fem::PressState& pressed = truths.back().press;
  const ContactPressure pressure = visible.pressure_on(pressed, 0);
  double force = 0.0;
  for (const auto& t : pressure.triangles) {
    const Eigen::Vector2d ab = pressure.places[t[1]] - pressure.places[t[0]];
    const Eigen::Vector2d ac = pressure.places[t[2]] - pressure.places[t[0]];
    const double area = 0.5 * std::abs(ab.x() * ac.y() - ab.y() * ac.x());
    force += 1e-3 * area * (pressure.kPa[t[0]] + pressure.kPa[t[1]] + pressure.kPa[t[2]]) / 3.0;
  }
  // The surface's stretch is left out by tractions, which are those of the undeformed gel.
  EXPECT_NEAR(force / pressed.wrench[2], 1.0, 0.05);
  for (const double kPa : visible.pressure_on(pressed, 1).kPa) EXPECT_EQ(kPa, 0.0);

  // Surfaces: the gel, its frame, the two objects.
  const auto at = [&](const Truth& truth, std::size_t object, double x) {
    const render::Scene scene = visible_scene(spec, plan, objects, visible, truth.press);
    return *scene.surfaces.at(2 + object).print->picture->at({x, 0.01});
  };
  EXPECT_NEAR(at(truths.front(), 0, 0.0), 0.4, 1e-6);
  EXPECT_NEAR(at(truths.back(), 0, 0.0), 0.8, 1e-6);
  EXPECT_NEAR(at(truths.back(), 0, 0.95), 0.3, 1e-6);
  EXPECT_NEAR(at(truths.back(), 1, 0.0), 0.4, 1e-6);
  Plan without = plan;
  without.object_print = without.skin_blanching = false;
  EXPECT_FALSE(visible_scene(spec, without, objects, visible, truths.back().press).surfaces.at(2).print);
}

// With fine relief what the gel wets is a sheet of its own: it has the object's print in the object's coordinates.
TEST(PrintOfAnObject, IsOnTheWettedSheetOfAFineRelief) {
  SceneSpec spec;
  spec.device = test::small_device();
  spec.object = parse_yaml<ObjectSpec>(
      "name: ribbed\nshape: {type: sphere, radius_mm: 4}\nalbedo: 0.8\nrelief: {type: waves, amplitude_um: 20, "
      "pitch_mm: "
      "0.5}\nprint:\n  - {type: specks, count: 5, diameters_mm: [0.3], size_mm: [1, 1]}\n",
      "ribbed.yaml");
  spec.motion = parse_yaml<MotionSpec>("start_mm: [0.5, -0.3, 3.8]\nkeys: []\n", "m.yaml");
  spec.membrane.pixel_um = 100;
  const Plan plan = make_plan(spec);
  ASSERT_TRUE(plan.fine_relief && plan.object_print);
  const test::TemporaryFolder cache;
  const auto gel = set_up_gel(spec.device, cache.path());
  const fem::PressState press = play_motion(spec, plan, *gel).back().press;
  const SceneView view(spec, plan, *gel);
  const auto relief = view.relief(press);
  ASSERT_TRUE(relief);
  const render::Scene scene = view.seen(press, relief);
  const render::Surface& wet = scene.surfaces.back();
  ASSERT_FALSE(wet.mesh.triangles.empty());
  ASSERT_TRUE(wet.print && scene.surfaces.at(2).print);
  EXPECT_EQ(wet.print->marks.size(), 5u);
  ASSERT_EQ(wet.print->material_mm.size(), wet.mesh.vertices.size());
  for (std::size_t i = 0; i < wet.mesh.vertices.size(); ++i) {
    const Eigen::Vector2d expected = wet.mesh.vertices[i].head<2>() - Eigen::Vector2d(0.5, -0.3);
    EXPECT_NEAR((wet.print->material_mm[i] - expected).norm(), 0.0, 1e-9);
  }
}

}  // namespace
}  // namespace touchstone::sim
