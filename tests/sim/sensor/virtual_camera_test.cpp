#include "sim/sensor/virtual_camera.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "render/imager/imager.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

/// A pad of 12 x 12 x 4 mm with 2 x 2 beads, a camera of 96 x 72 pixels with a small hole, and a flat probe of 3 mm.
SceneSpec small_scene(const std::string& keys) {
  SceneSpec scene;
  scene.device = test::small_device();
  scene.object = parse_yaml<ObjectSpec>(
      "name: probe\nshape: {type: rounded_cylinder, radius_mm: 1.5, edge_radius_mm: 0.3, height_mm: 4}\n"
      "friction: 0.7\nscreen: {radius_mm: 8, behind_mm: 4, radiance: [2, 2, 2]}\n",
      "probe.yaml");
  scene.motion = parse_yaml<MotionSpec>("start_mm: [0, 0, 0.5]\nkeys:\n" + keys, "motion.yaml");
  scene.light.max_samples = 32;
  scene.seed = 7;
  return scene;
}

const test::TemporaryFolder& cache() {
  static const test::TemporaryFolder folder;
  return folder;
}

struct Played {
  SceneSpec scene;
  Plan plan;
  std::shared_ptr<const fem::Compliance> gel;
  std::vector<Truth> truths;
};

Played play(const std::string& keys) {
  Played played;
  played.scene = small_scene(keys);
  played.plan = make_plan(played.scene);
  played.gel = set_up_gel(played.scene.device, cache().path());
  played.truths = play_motion(played.scene, played.plan, *played.gel);
  return played;
}

TEST(PlayMotion, ForcesFollowTheKeys) {
  const Played p = play("  - {frames: 4, z: {force_N: 1}}\n  - {frames: 2, x: {force_N: 0.3}}\n");
  ASSERT_EQ(p.truths.size(), 7u);
  EXPECT_EQ(p.truths[0].press.wrench.norm(), 0.0) << "it starts in the air";
  for (int i = 1; i <= 4; ++i) EXPECT_NEAR(p.truths[i].press.wrench[2], 0.25 * i, 1e-5);
  const double shear_at_rest = p.truths[4].press.wrench[0];
  EXPECT_NEAR(p.truths[5].press.wrench[0], (shear_at_rest + 0.3) / 2, 1e-5) << "a ramp starts at the force there was";
  EXPECT_NEAR(p.truths[6].press.wrench[0], 0.3, 1e-5);
  EXPECT_NEAR(p.truths[6].press.wrench[2], 1.0, 1e-5) << "an axis that isn't named keeps its force";
}

TEST(PlayMotion, FiniteStrainChangesALargePressAndHardlyASmallOne) {
  // Under a plate wider than the pad: at finite strain outlines don't cut hats, which would be most of a difference.
  const std::string keys = "  - {frames: 1, z: {position_mm: 0.98}}\n  - {frames: 1, z: {position_mm: 0.4}}\n";
  SceneSpec scene = small_scene(keys);
  scene.object.shape = parse_yaml<ShapeSpec>("{type: box, size_mm: [30, 30, 2]}", "plate.yaml");
  scene.motion.start_mm = {0, 0, 1.5};
  scene.device.mesh.fine_mm = 1.6;
  scene.device.mesh.coarse_mm = 3.0;
  const auto gel = set_up_gel(scene.device, cache().path());
  const std::vector<Truth> linear = play_motion(scene, make_plan(scene), *gel);
  scene.effects.elasticity = Elasticity::neo_hookean;
  const std::vector<Truth> finite = play_motion(scene, make_plan(scene), *gel);
  ASSERT_EQ(finite.size(), 3u);
  EXPECT_EQ(finite[0].press.wrench.norm(), 0.0);
  const double small = finite[1].press.wrench[2] / linear[1].press.wrench[2] - 1.0;
  const double large = finite[2].press.wrench[2] / linear[2].press.wrench[2] - 1.0;
  EXPECT_LT(std::abs(small), 0.03);
  EXPECT_GT(std::abs(large), std::abs(small));
  EXPECT_EQ(finite[2].press.bead_displacement.rows(), linear[2].press.bead_displacement.rows());
}

TEST(PlayMotion, AGelAtFiniteStrainRelaxesWhereItStands) {
  const std::string keys = "  - {frames: 1, z: {position_mm: 4.4}}\n  - {frames: 3, z: {position_mm: 4.4}}\n";
  SceneSpec scene = small_scene(keys);
  scene.effects.elasticity = Elasticity::neo_hookean;
  scene.object.shape.type = ShapeKind::sphere;
  scene.object.shape.radius_mm = 5.0;
  scene.motion.start_mm.z() = 5.5;
  scene.device.mesh.fine_mm = 1.6;
  scene.device.mesh.coarse_mm = 3.0;
  const auto gel = set_up_gel(scene.device, cache().path());
  const std::vector<Truth> elastic = play_motion(scene, make_plan(scene), *gel);
  scene.device.gel.relaxation = {{0.4, 0.05}};
  const std::vector<Truth> relaxing = play_motion(scene, make_plan(scene), *gel);
  ASSERT_EQ(relaxing.size(), 5u);
  EXPECT_NEAR(elastic[4].press.wrench[2], elastic[1].press.wrench[2], 1e-6);
  EXPECT_LT(relaxing[1].press.wrench[2], elastic[1].press.wrench[2]) << "some of it fades during the press";
  for (int k = 2; k < 5; ++k) {
    EXPECT_LT(relaxing[k].press.wrench[2], relaxing[k - 1].press.wrench[2]);
    EXPECT_GT(relaxing[k].press.wrench[2], 0.6 * elastic[k].press.wrench[2]);
    EXPECT_EQ(relaxing[k].press.surface_displacement, elastic[k].press.surface_displacement);
  }
}

TEST(PlayMotion, TimesAreThoseOfTheFrameRate) {
  const Played p = play("  - {frames: 3, z: {position_mm: 0.4}}\n");
  EXPECT_EQ(p.truths[0].t_us, 0);
  EXPECT_EQ(p.truths[1].t_us, 33333);
  EXPECT_EQ(p.truths[3].t_us, 100000);
}

TEST(PlayMotion, ATiltedPlateAlignsItselfAndIsLedByAnglesAgain) {
  SceneSpec scene = small_scene(
      "  - {frames: 1, angles_deg: [3, -2, 0]}\n"
      "  - {frames: 2, z: {force_N: 1}}\n"
      "  - {frames: 4, turn_x: {torque_Nmm: 0}, turn_y: {torque_Nmm: 0}}\n"
      "  - {frames: 1, z: {force_N: 1.2}}\n"
      "  - {frames: 2, angles_deg: [2, 0, 0]}\n");
  scene.object.shape.type = ShapeKind::box;
  scene.object.shape.size_mm = {4.0, 4.0, 1.0};
  scene.motion.start_mm.z() = 1.0;
  const Plan plan = make_plan(scene);
  const auto gel = set_up_gel(scene.device, cache().path());
  const std::vector<Truth> truths = play_motion(scene, plan, *gel);
  ASSERT_EQ(truths.size(), 11u);
  const auto torque = [&](std::size_t i) {
    const auto& press = truths[i].press;
    return Eigen::Vector3d(Eigen::Vector3d(press.wrench.tail<3>()) -
                           press.gel_from_object.translation.cross(Eigen::Vector3d(press.wrench.head<3>())));
  };
  const auto tilt = [&](std::size_t i) { return std::acos(truths[i].press.gel_from_object.rotation(2, 2)); };
  const Eigen::Vector3d before = torque(3);
  EXPECT_GT(before.norm(), 0.1) << "held at an angle";
  EXPECT_LT((torque(5) - before / 2).head<2>().norm(), 1e-3) << "a ramp starts at the torque that was there";
  EXPECT_LT(torque(7).head<2>().norm(), 1e-4);
  EXPECT_LT(tilt(7), 0.2 * tilt(3));
  EXPECT_LT(torque(8).head<2>().norm(), 1e-4) << "a torque stays";
  const double degree = std::acos(-1.0) / 180.0;
  EXPECT_NEAR(tilt(10), 2.0 * degree, 1e-9) << "angles lead again";
  EXPECT_NEAR(tilt(9), 1.0 * degree, tilt(8)) << "from where the torques had turned it";
}

TEST(PlayMotion, AForceThatCannotBeMetNamesTheKeysLine) {
  try {
    play("  - {frames: 2, z: {force_N: 0.5}}\n  - {frames: 2, x: {force_N: 3}}\n");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.where().line, 4);
    EXPECT_THAT(error.what(), HasSubstr("slip"));
  }
}

// Light of the pixels that were not traced again must be what tracing the whole frame would give, within the noise.
// `all`: the camera is given all frames, not of the first alone. Gives how many pixels were traced.
std::int64_t expect_partial_frame_agrees(Played p, std::size_t frame, bool all = false) {
  p.scene.outputs = {.frames = false, .ideal = false, .radiance = true};
  p.scene.light.max_samples = 64;
  p.plan = make_plan(p.scene);
  const VirtualCamera camera(p.scene, p.plan, *p.gel, std::span(p.truths).first(all ? p.truths.size() : 1));
  const Capture part = camera.capture(p.truths[frame]);
  const Capture whole = camera.capture_whole(p.truths[frame]);
  EXPECT_LT(part.pixels_traced, whole.pixels_traced) << "nothing was saved";
  EXPECT_GT(part.pixels_traced, 0);

  const render::Imager sensor = imager(p.scene.device, p.plan.bands, true);
  for (int channel = 0; channel < sensor.quantum_efficiency.rows(); ++channel) {
    const render::ImagerResponse response = render::response_of(render::channel_imager(sensor, channel));
    double square = 0.0;
    for (int row = 0; row < whole.radiance.rows; ++row) {
      for (int column = 0; column < whole.radiance.cols; ++column) {
        const auto a = part.radiance.at<cv::Vec3f>(row, column);
        const auto b = whole.radiance.at<cv::Vec3f>(row, column);
        double electrons = 0.0;
        double difference = 0.0;
        for (int band = 0; band < 3; ++band) {
          electrons += response.electrons_per_irradiance(0, band) * b[band];
          difference += response.electrons_per_irradiance(0, band) * (a[band] - b[band]);
        }
        const double noise = render::noise_e(response, electrons);
        square += difference * difference / (noise * noise);
      }
    }
    const double rms = std::sqrt(square / static_cast<double>(whole.radiance.total()));
    // Two renderings, each with a standard error of at most the noise where its samples suffice, and the tolerated
    // change.
    EXPECT_LT(rms, 1.5) << "in units of the imager's noise, channel " << channel;
  }
  return part.pixels_traced;
}

TEST(VirtualCamera, ThePartialFrameAgreesWithTheWholeOne) {
  expect_partial_frame_agrees(play("  - {frames: 2, z: {force_N: 1}}\n"), 2);
}

// Of a dense motion's frames some are keys: a frame between two of them needs fewer pixels than one that only the frame
// at rest is known of, and is as good.
TEST(VirtualCamera, AFrameOfADenseMotionLeansOnItsNeighbours) {
  const Played dense = play("  - {frames: 60, z: {force_N: 1}}\n  - {frames: 45, x: {force_N: 0.3}}\n");
  ASSERT_EQ(dense.truths.size(), 106u) << "keys at 50 and 100";
  const std::int64_t with_first = expect_partial_frame_agrees(dense, 90);
  const std::int64_t with_keys = expect_partial_frame_agrees(dense, 90, true);
  EXPECT_LT(with_keys, with_first);
}

// Beads that move by a small part of a pixel are traced again, though no ray of the preview meets another thing.
TEST(VirtualCamera, BeadsThatHardlyMoveAreTracedAgain) {
  Played p = play("  - {frames: 1, z: {force_N: 0.01}}\n");
  p.scene.outputs = {.frames = false, .ideal = false, .radiance = true};
  p.plan = make_plan(p.scene);
  const VirtualCamera camera(p.scene, p.plan, *p.gel, p.truths.front());
  Truth moved = p.truths.front();
  EXPECT_EQ(camera.capture(moved).pixels_traced, 0);
  moved.press.bead_displacement.col(0).array() += 0.002;
  const std::int64_t beads = camera.capture(moved).pixels_traced;
  EXPECT_GT(beads, 0);
  moved.press.bead_displacement.col(0).array() += 0.05;
  EXPECT_NEAR(static_cast<double>(camera.capture(moved).pixels_traced), static_cast<double>(beads),
              0.3 * static_cast<double>(beads));
}

TEST(VirtualCamera, ThePartialFrameAgreesWithTheWholeOneThroughALens) {
  Played p = play("  - {frames: 2, z: {force_N: 1}}\n");
  CameraSpec& camera = *p.scene.device.camera;
  auto& lens = camera.optics.emplace<LensSpec>();
  lens.focal_length_mm = 4.0;
  lens.f_number = 8.0;
  lens.focus_distance_mm = 16.0;
  lens.distortion = {-0.1, 0.0, 0.001, 0.0};
  camera.exposure_us = 20.0;
  expect_partial_frame_agrees(p, 2);
}

TEST(VirtualCamera, ThePartialFrameAgreesWithTheWholeOneInEachColourOfABinnedPixel) {
  Played p = play("  - {frames: 2, z: {force_N: 1}}\n");
  CameraSpec& camera = *p.scene.device.camera;
  camera.bayer = render::BayerPattern::binned;
  camera.quantum_efficiency_red = {0.45, 0.06, 0.03};
  camera.quantum_efficiency_green = {0.08, 0.50, 0.10};
  camera.quantum_efficiency_blue = {0.02, 0.10, 0.45};
  expect_partial_frame_agrees(p, 2);
}

/// The small device with pixels so small that a point is some 10 of them wide.
Played play_behind_a_wide_hole(const std::string& keys) {
  Played p = play(keys);
  CameraSpec& camera = *p.scene.device.camera;
  camera.width = 112;
  camera.height = 84;
  camera.pixel_pitch_um = 10.0;
  camera.exposure_us = 2000.0;
  p.scene.outputs = {.frames = false, .ideal = false, .radiance = true};
  p.scene.light.max_samples = 64;
  p.plan = make_plan(p.scene);
  return p;
}

double rms_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L2) / std::sqrt(static_cast<double>(a.total()) * a.channels()) / cv::mean(b)[0];
}

// Behind a wide hole every frame is traced whole, with a path or so a pixel, and yet is nearer to many paths a pixel
// than what keys and traced pixels give.
TEST(VirtualCamera, BehindAWideHolePixelsShareTheirPaths) {
  const Played p = play_behind_a_wide_hole("  - {frames: 2, z: {force_N: 1}}\n");
  ASSERT_TRUE(p.plan.shared_paths);
  const VirtualCamera camera(p.scene, p.plan, *p.gel, p.truths);
  const Capture shared = camera.capture(p.truths.back());
  SceneSpec by_keys = p.scene;
  by_keys.effects.shared_paths = Switch::off;
  const Plan plan = make_plan(by_keys);
  ASSERT_FALSE(plan.shared_paths);
  const VirtualCamera keys(by_keys, plan, *p.gel, p.truths.front());
  const Capture traced = keys.capture(p.truths.back());
  SceneSpec many = by_keys;
  many.light.min_samples = many.light.max_samples = 128;
  many.seed = 1;
  const cv::Mat truth = VirtualCamera(many, plan, *p.gel, p.truths.front()).capture_whole(p.truths.back()).radiance;
  const double off = rms_difference(shared.radiance, truth);
  EXPECT_LT(off, 0.015) << "with the reference's own noise";
  EXPECT_LT(off, rms_difference(traced.radiance, truth));
}

// Of a moving frame each moment shares its paths.
TEST(VirtualCamera, MotionBlurBehindAWideHole) {
  Played p =
      play_behind_a_wide_hole("  - {frames: 2, z: {position_mm: -0.3}}\n  - {frames: 2, x: {position_mm: 0.6}}\n");
  p.scene.effects.motion_blur = Switch::on;
  p.plan = make_plan(p.scene);
  const std::vector<Truth> truths = play_motion(p.scene, p.plan, *p.gel);
  const Truth& moving = truths[3];
  ASSERT_FALSE(moving.later.empty());
  const VirtualCamera camera(p.scene, p.plan, *p.gel, truths);
  const Capture shared = camera.capture(moving);
  const Capture whole = camera.capture_whole(moving);
  EXPECT_LT(rms_difference(shared.radiance, whole.radiance), 0.03) << "with the whole frame's noise";
}

TEST(VirtualCamera, SharedPathsAreRefusedWhereTheyDoNotHold) {
  const auto message = [](SceneSpec scene) {
    scene.effects.shared_paths = Switch::on;
    try {
      make_plan(scene);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const std::string keys = "  - {frames: 2, z: {force_N: 1}}\n";
  EXPECT_THAT(message(small_scene(keys)), HasSubstr("effects.shared_paths: on, but the camera's hole makes points"));
  SceneSpec through_lens = small_scene(keys);
  auto& lens = through_lens.device.camera->optics.emplace<LensSpec>();
  lens.focal_length_mm = 4.0;
  lens.f_number = 8.0;
  lens.focus_distance_mm = 16.0;
  EXPECT_THAT(message(through_lens), HasSubstr("through a lens"));
  EXPECT_EQ(message(play_behind_a_wide_hole(keys).scene), "no error");
}

TEST(VirtualCamera, AnObjectThatDoesNotMoveCostsNothing) {
  const Played p = play("  - {frames: 1, z: {position_mm: 0.5}}\n");
  const VirtualCamera camera(p.scene, p.plan, *p.gel, p.truths.front());
  const Capture capture = camera.capture(p.truths.back());
  EXPECT_EQ(capture.pixels_traced, 0);
  EXPECT_EQ(capture.paths_traced, 0);
}

TEST(VirtualCamera, TheSameTruthGivesTheSameBytes) {
  const Played p = play("  - {frames: 2, z: {force_N: 1}}\n");
  const VirtualCamera one(p.scene, p.plan, *p.gel, p.truths.front());
  const VirtualCamera other(p.scene, p.plan, *p.gel, p.truths.front());
  const cv::Mat a = one.capture(p.truths.back()).frame;
  const cv::Mat b = other.capture(p.truths.back()).frame;
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0.0);
  const cv::Mat c = one.capture(p.truths.front()).frame;
  EXPECT_GT(cv::norm(a, c, cv::NORM_INF), 0.0) << "the press can't be seen";
}

}  // namespace
}  // namespace touchstone::sim
