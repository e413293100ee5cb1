// Motions whose time matters: a gel that relaxes, an object that vibrates.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>

#include "core/units.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

/// A pad of 8 x 8 x 3 mm with four beads, whose layer has its lowest eigenfrequency at 832 Hz, and a flat probe of 3 mm
/// that starts where it touches.
SceneSpec scene_with(const std::string& keys) {
  SceneSpec scene;
  scene.device = parse_yaml<DeviceSpec>(R"(
name: small
gel: {size_x_mm: 8, size_y_mm: 8, thickness_mm: 3, youngs_modulus_MPa: 0.3, poisson_ratio: 0.49, density_kg_m3: 1010}
mesh: {fine_mm: 0.8, coarse_mm: 2, fine_half_extent_mm: [2, 2], fine_depth_mm: 1}
beads: {grid: 2, spacing_mm: 2, diameter_mm: 0.6, depth_mm: 0.8}
plate: {thickness_mm: 1, refractive_index: 1.5}
)",
                                        "small.yaml");
  scene.object = parse_yaml<ObjectSpec>(
      "name: probe\nshape: {type: rounded_cylinder, radius_mm: 1.9, edge_radius_mm: 0.0, height_mm: 4}\nfriction: 1\n",
      "probe.yaml");
  scene.motion = parse_yaml<MotionSpec>("start_mm: [0, 0, 0]\nframe_rate_Hz: 1000\nkeys:\n" + keys, "motion.yaml");
  scene.outputs.frames = false;
  scene.effects.friction = Switch::on;
  return scene;
}

const test::TemporaryFolder& cache() {
  static const test::TemporaryFolder folder;
  return folder;
}

std::vector<Truth> play(const SceneSpec& scene) {
  const Plan plan = make_plan(scene);
  const auto gel = set_up_gel(scene.device, cache().path());
  return play_motion(scene, plan, *gel, {}, set_up_vibration(scene, plan, cache().path()).get());
}

std::string error_of(const SceneSpec& scene) {
  try {
    play(scene);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// sine and cosine part of the last `frames` values at the frequency, about their mean.
std::complex<double> harmonic(const std::vector<Truth>& truths, int frames, double frequency_Hz,
                              const std::function<double(const fem::PressState&)>& value) {
  std::complex<double> sum = 0.0;
  for (std::size_t i = truths.size() - frames; i < truths.size(); ++i) {
    const double t = static_cast<double>(i + frames - truths.size() + 1) / 1000.0;
    sum += value(truths[i].press) *
           std::complex<double>(std::sin(2.0 * kPi * frequency_Hz * t), std::cos(2.0 * kPi * frequency_Hz * t));
  }
  return 2.0 / frames * sum;
}

double normal_force(const fem::PressState& state) {
  return state.wrench[2];
}

TEST(TimeEffects, ForcesRelaxByTheFrameRatesTime) {
  SceneSpec scene = scene_with("  - {frames: 1, z: {position_mm: -0.2}}\n  - {frames: 20}\n");
  scene.effects.friction = Switch::off;
  const std::vector<Truth> elastic = play(scene);
  scene.device.gel.relaxation = {{0.3, 0.005}, {0.1, 0.1}};
  const std::vector<Truth> truths = play(scene);
  for (int n = 1; n <= 21; ++n) {
    double share = 0.6;
    for (const auto& [part, time] : scene.device.gel.relaxation) {
      share += part * time / 1e-3 * -std::expm1(-1e-3 / time) * std::exp(-(n - 1) * 1e-3 / time);
    }
    EXPECT_NEAR(truths[n].press.wrench[2], share * elastic[n].press.wrench[2], 1e-7)
        << n;  // how well the lookup settles
  }
  scene.effects.relaxation = Switch::off;
  EXPECT_EQ(play(scene).back().press.wrench, elastic.back().press.wrench);
}

TEST(TimeEffects, ASlowVibrationIsTheQuasiStaticPressAtEachFrame) {
  const SceneSpec scene = scene_with(
      "  - {frames: 2, z: {force_N: 0.5}}\n"
      "  - {frames: 20, vibration: {axis: z, amplitude_mm: 0.02, frequency_Hz: 50}}\n");
  ASSERT_FALSE(make_plan(scene).inertia);
  const std::vector<Truth> truths = play(scene);
  const double mean = truths[2].press.gel_from_object.translation.z();
  for (int i = 1; i <= 20; ++i) {
    EXPECT_NEAR(truths[2 + i].press.gel_from_object.translation.z(), mean + 0.02 * std::sin(2 * kPi * 0.05 * i), 1e-9);
  }
  EXPECT_NEAR(truths.back().press.wrench[2], 0.5, 0.01) << "back where it was";
  const std::complex<double> force = harmonic(truths, 20, 50.0, normal_force);
  EXPECT_LT(force.real(), -0.02);
  EXPECT_LT(std::abs(force.imag()), 0.02 * std::abs(force.real()));
}

// The two ways meet at low frequency: a contact that sticks, slowly shaken, is the static contact.
TEST(TimeEffects, InertiaChangesNothingAtLowFrequency) {
  SceneSpec scene = scene_with(
      "  - {frames: 2, z: {force_N: 0.5}}\n"
      "  - {frames: 20, vibration: {axis: z, amplitude_mm: 0.005, frequency_Hz: 50}}\n");
  const std::complex<double> still = harmonic(play(scene), 20, 50.0, normal_force);
  scene.effects.inertia = Switch::on;
  const std::vector<Truth> truths = play(scene);
  const std::complex<double> shaken = harmonic(truths, 20, 50.0, normal_force);
  EXPECT_NEAR(std::abs(shaken), std::abs(still), 0.02 * std::abs(still));
  EXPECT_NEAR(truths[7].press.gel_from_object.translation.z() - truths[2].press.gel_from_object.translation.z(), 0.005,
              1e-12);
}

TEST(TimeEffects, AFastVibrationIsTheGelsSteadyAnswer) {
  SceneSpec scene = scene_with(
      "  - {frames: 2, z: {force_N: 0.5}}\n"
      "  - {frames: 20, vibration: {axis: x, amplitude_mm: 0.004, frequency_Hz: 350}}\n");
  scene.device.gel.relaxation = {{0.1, 0.0005}};
  const Plan plan = make_plan(scene);
  ASSERT_TRUE(plan.inertia);
  const auto gel = set_up_gel(scene.device, cache().path());
  const auto vibration = set_up_vibration(scene, plan, cache().path());
  std::vector<Truth> truths = play_motion(scene, plan, *gel, {}, vibration.get());
  const fem::PressState state = truths[9].press;
  scene.motion.keys.back().vibration->amplitude_mm = 0.0;
  const std::vector<Truth> mean = play_motion(scene, plan, *gel);
  for (std::size_t i = 0; i < truths.size(); ++i) {  // the mean creeps
    truths[i].press.wrench -= mean[i].press.wrench;
    truths[i].press.bead_displacement -= mean[i].press.bead_displacement;
  }
  std::vector<int> touching;
  for (std::size_t v = 0; v < gel->vertices.size(); ++v) {
    if (truths[2].press.node_state[v] != fem::NodeState::open) touching.push_back(static_cast<int>(v));
  }
  const double omega = 2.0 * kPi * 350.0;
  const fem::StuckPatch patch(*gel, *vibration, touching, truths[2].press.cuts.get());
  const auto wanted = patch.answer({0.004, 0, 0}, omega, prony_series(scene.device.gel));
  const auto force = harmonic(truths, 20, 350.0, [](const fem::PressState& s) { return s.wrench[0]; });
  EXPECT_LT(std::abs(force - wanted.force.x()), 1e-3 * std::abs(wanted.force.x()));
  const auto bead = harmonic(truths, 20, 350.0, [](const fem::PressState& s) { return s.bead_displacement(0, 0); });
  EXPECT_LT(std::abs(bead - wanted.bead_displacement(0, 0)), 1e-3 * std::abs(bead));
  EXPECT_GT(std::abs(force.imag()), 0.02 * std::abs(force)) << "it loses energy";
  // Forces, tractions and torque belong together at every frame.
  const Eigen::MatrixX3d lumped = gel->mass * state.traction;
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (Eigen::Index v = 0; v < lumped.rows(); ++v) {
    const Eigen::Vector3d at = gel->vertices[v] + state.surface_displacement.row(v).transpose();
    torque -= at.cross(Eigen::Vector3d(lumped.row(v)));
  }
  EXPECT_LT((lumped.colwise().sum().transpose() + state.wrench.head<3>()).norm(), 1e-9);
  EXPECT_LT((torque - state.wrench.tail<3>()).norm(), 1e-9);
}

TEST(TimeEffects, AVibrationThatTheModelCannotDoIsRefusedAtItsKey) {
  const std::string press = "  - {frames: 2, z: {force_N: 0.5}}\n";
  EXPECT_THAT(
      error_of(scene_with(press + "  - {frames: 9, vibration: {axis: z, amplitude_mm: 2, frequency_Hz: 300}}\n")),
      HasSubstr("motion.yaml:5: frame 3: a vibration of 2 mm"));
  EXPECT_THAT(
      error_of(scene_with(press + "  - {frames: 9, vibration: {axis: x, amplitude_mm: 1, frequency_Hz: 300}}\n")),
      HasSubstr("would slide"));
  EXPECT_THAT(
      error_of(scene_with(press + "  - {frames: 9, vibration: {axis: z, amplitude_mm: 0.001, frequency_Hz: 9000}}\n")),
      HasSubstr("too fast for the gel's"));
}

TEST(TimeEffects, InTheAirAVibrationOnlyMovesTheObject) {
  SceneSpec scene = scene_with("  - {frames: 4, vibration: {axis: z, amplitude_mm: 0.1, frequency_Hz: 300}}\n");
  scene.motion.start_mm.z() = 1.0;
  for (const Truth& truth : play(scene)) EXPECT_EQ(truth.press.wrench.norm(), 0.0);
}

}  // namespace
}  // namespace touchstone::sim
