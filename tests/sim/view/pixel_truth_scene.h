#pragma once
// A small scene for tests of the truth of pixels, played to its end, and where its points appear by closed form.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "sim/files/image_file.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {

/// A pad of 12 x 12 x 4 mm with 2 x 2 beads, a camera of 160 x 120 pixels that looks straight up through the plate.
inline SceneSpec truth_scene(const std::string& keys) {
  SceneSpec scene;
  scene.device = test::small_device({.width = 160, .height = 120, .pixel_pitch_um = 18, .bead_spacing_mm = 5});
  scene.object =
      parse_yaml<ObjectSpec>("name: ball\nshape: {type: sphere, radius_mm: 4}\nfriction: 0.7\n", "ball.yaml");
  scene.motion = parse_yaml<MotionSpec>("start_mm: [0, 0, 4.5]\nkeys:\n" + keys, "motion.yaml");
  scene.outputs = parse_yaml<OutputSpec>(
      "{frames: false, depth: true, normals: true, ids: true, contact: true, flow: true}", "outputs.yaml");
  scene.light.max_samples = 16;
  scene.light.min_samples = 8;
  return scene;
}

inline const test::TemporaryFolder& truth_cache() {
  static const test::TemporaryFolder folder;
  return folder;
}

struct PlayedTruth {
  SceneSpec scene;
  Plan plan;
  std::shared_ptr<const fem::Compliance> gel;
  std::vector<Truth> truths;

  explicit PlayedTruth(SceneSpec scene_of) : scene(std::move(scene_of)), plan(make_plan(scene)) {
    gel = set_up_gel(scene.device, truth_cache().path());
    truths = play_motion(scene, plan, *gel);
  }
  Capture last() const { return VirtualCamera(scene, plan, *gel, truths.front()).capture(truths.back()); }
};

inline const char* const kTruthPress =
    "  - {frames: 1, z: {position_mm: 3.6}}\n  - {frames: 1, x: {position_mm: 0.15}}\n";

inline const PlayedTruth& pressed_truth() {
  static const PlayedTruth played(truth_scene(kTruthPress));
  return played;
}

inline cv::Mat channel(const LinearImage& image, const std::string& name) {
  const auto found = std::find(image.channel_names.begin(), image.channel_names.end(), name);
  EXPECT_NE(found, image.channel_names.end()) << name;
  cv::Mat plane;
  cv::extractChannel(image.image, plane, static_cast<int>(found - image.channel_names.begin()));
  return plane;
}

/// A lens of strong barrel distortion whose axis isn't the picture's middle, where the pinhole was.
inline void make_lens(CameraSpec& camera) {
  auto& lens = camera.optics.emplace<LensSpec>();
  lens.camera_matrix = Eigen::Vector4d(281.0, 274.0, 83.0, 56.0);
  lens.distortion = {-0.3, 0.0, 0.0, 0.0};
  lens.f_number = 4.0;
  lens.focus_distance_mm = 17.0;
}

/// Where a point appears to a camera that looks straight up: the angle in air by bisection, on the sum of the layers'
/// paths by Snell's law.
inline Eigen::Vector2d projected_by_bisection(const DeviceSpec& device, const Eigen::Vector3d& point) {
  const CameraSpec& camera = *device.camera;
  const double glass_low = -device.gel.thickness_mm - device.plate.thickness_mm;
  const double air = glass_low - camera.position_mm.z();
  const double r = point.head<2>().norm();
  double low = 0.0, high = 1.5;
  for (int i = 0; i < 200; ++i) {
    const double angle = 0.5 * (low + high);
    const double in_glass = std::asin(std::sin(angle) / device.plate.refractive_index);
    const double in_gel = std::asin(std::sin(angle) / device.gel.refractive_index);
    const double offset = air * std::tan(angle) + device.plate.thickness_mm * std::tan(in_glass) +
                          (point.z() + device.gel.thickness_mm) * std::tan(in_gel);
    (offset < r ? low : high) = angle;
  }
  const Eigen::Vector2d tangents = std::tan(low) / std::max(r, 1e-12) * point.head<2>();
  if (const auto* lens = std::get_if<LensSpec>(&camera.optics)) {
    const Eigen::Vector4d& matrix = *lens->camera_matrix;  // whole numbers are OpenCV's pixel centres
    const Eigen::Vector2d distorted = (1.0 + lens->distortion[0] * tangents.squaredNorm()) * tangents;
    return {matrix[0] * distorted.x() + matrix[2] + 0.5, matrix[1] * distorted.y() + matrix[3] + 0.5};
  }
  const double scale = std::get<PinholeSpec>(camera.optics).hole_to_sensor_mm / (camera.pixel_pitch_um * 1e-3);
  return {0.5 * camera.width + scale * tangents.x(), 0.5 * camera.height + scale * tangents.y()};
}

}  // namespace touchstone::sim
