// The truth of pixels through a lens: what a pinhole can't tell of it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "render/cameras/first_hits.h"
#include "sim/scene/device_camera.h"
#include "sim/view/pixel_truth.h"
#include "tests/sim/view/pixel_truth_scene.h"

namespace touchstone::sim {
namespace {

OutputSpec all_layers() {
  return parse_yaml<OutputSpec>("{frames: false, depth: true, normals: true, ids: true, contact: true, flow: true}",
                                "outputs.yaml");
}

SeenGeometry seen_of(const PlayedTruth& p, const fem::PressState& press) {
  const std::vector<VisibleObject> objects = visible_objects(p.scene);
  return seen_geometry(p.scene, p.plan, objects, VisibleGel(*p.gel), press);
}

render::LensCamera lens_of(const DeviceSpec& device) {
  return std::get<render::LensCamera>(camera_of(*device.camera));
}

/// A bare gel that nothing has touched yet, before the lens.
const PlayedTruth& bare() {
  static const PlayedTruth played = [] {
    SceneSpec scene = truth_scene("  - {frames: 1, z: {position_mm: 4.4}}\n");
    make_lens(*scene.device.camera);
    scene.device.beads.reset();
    return PlayedTruth(scene);
  }();
  return played;
}

TEST(LensTruth, AnUndistortedLensInThePinholesPlaceHasItsLayers) {
  const PlayedTruth& p = pressed_truth();
  const SeenGeometry seen = seen_of(p, p.truths.back().press);
  DeviceSpec device = p.scene.device;
  const render::Camera hole = camera_of(*device.camera);
  make_lens(*device.camera);
  std::get<LensSpec>(device.camera->optics).distortion.clear();
  const double focal = 5.0 / 0.018;
  std::get<LensSpec>(device.camera->optics).camera_matrix = Eigen::Vector4d(focal, focal, 79.5, 59.5);
  const render::Camera lens = camera_of(*device.camera);

  const auto by_hole = render::first_hits(seen.inside, render::make_ready(hole));
  const auto by_lens = render::first_hits(seen.inside, render::make_ready(lens));
  ASSERT_EQ(by_hole.size(), by_lens.size());
  for (std::size_t i = 0; i < by_hole.size(); ++i) {
    ASSERT_EQ(by_hole[i].object, by_lens[i].object);
    ASSERT_LT((by_hole[i].position - by_lens[i].position).norm(), 1e-6);
  }
  const LinearImage one = pixel_truth(seen, hole, all_layers());
  const LinearImage other = pixel_truth(seen, lens, all_layers());
  ASSERT_EQ(one.channel_names, other.channel_names);
  EXPECT_LT(cv::norm(one.image, other.image, cv::NORM_INF), 1e-4);
}

// By hand: the distortion inverted by bisection, the ray bent by n sin = const, followed to the plane z = 0.
TEST(LensTruth, DepthOfAFlatGelBeforeATiltedLensIsThatOfTheBentRay) {
  const PlayedTruth& p = bare();
  DeviceSpec device = p.scene.device;
  device.camera->position_mm = {3.0, -2.0, -16.0};
  const render::LensCamera lens = lens_of(device);
  const SeenGeometry seen = seen_of(p, p.truths.front().press);
  const cv::Mat depth = channel(pixel_truth(seen, lens, all_layers()), "depth.Z");
  const Eigen::Vector3d eye = lens.gel_from_camera.translation;
  const Eigen::Vector3d axis = lens.gel_from_camera.turn(Eigen::Vector3d::UnitZ());
  double least = 1e9, most = 0.0;
  int checked = 0;
  for (int row = 0; row < 120; row += 7) {
    for (int column = 0; column < 160; column += 7) {
      const Eigen::Vector2d distorted((column - lens.matrix.cx) / lens.matrix.fx,
                                      (row - lens.matrix.cy) / lens.matrix.fy);
      double low = 0.0, high = 1.0;
      for (int i = 0; i < 100; ++i) {
        const double r = 0.5 * (low + high);
        (r * (1.0 - 0.3 * r * r) < distorted.norm() ? low : high) = r;
      }
      const Eigen::Vector2d tangents = low / std::max(distorted.norm(), 1e-300) * distorted;
      const Eigen::Vector3d in_air =
          lens.gel_from_camera.turn(Eigen::Vector3d(tangents.x(), tangents.y(), 1.0).normalized());
      const double sine = in_air.head<2>().norm();
      double across = 0.0;
      for (const auto& [thickness, index] : {std::pair(11.0, 1.0), std::pair(1.0, 1.5), std::pair(4.0, 1.45)}) {
        across += thickness * std::tan(std::asin(sine / index));
      }
      const Eigen::Vector2d offset = across / sine * in_air.head<2>();
      const Eigen::Vector3d place(eye.x() + offset.x(), eye.y() + offset.y(), 0.0);
      if (place.head<2>().cwiseAbs().maxCoeff() > 5.9) continue;  // beside the pad
      const double expected = (place - eye).dot(axis);
      ASSERT_NEAR(depth.at<float>(row, column), expected, 2e-5) << row << " " << column;
      least = std::min(least, expected);
      most = std::max(most, expected);
      ++checked;
    }
  }
  EXPECT_GT(checked, 200);
  EXPECT_GT(most - least, 1.0) << "tilted far enough to tell";
}

TEST(LensTruth, ASidewaysMotionFlowsAsClosedFormHasIt) {
  const PlayedTruth& p = bare();
  const Eigen::Vector3d motion(0.4, -0.25, 0.0);
  SeenGeometry seen = seen_of(p, p.truths.front().press);
  for (Eigen::Vector3d& rest : seen.sheet.rest) rest -= motion;
  const LinearImage truth = pixel_truth(seen, lens_of(p.scene.device), all_layers());
  const cv::Mat x = channel(truth, "flow.X"), y = channel(truth, "flow.Y");
  const auto hits = render::first_hits(seen.inside, render::make_ready(lens_of(p.scene.device)));
  double least = 1e9, most = 0.0;
  for (int row = 0; row < 120; row += 7) {
    for (int column = 0; column < 160; column += 7) {
      const Eigen::Vector3d place = hits[static_cast<std::size_t>(row * 160 + column)].position;
      const Eigen::Vector2d here(column + 0.5, row + 0.5);
      ASSERT_LT((projected_by_bisection(p.scene.device, place) - here).norm(), 2e-4);
      const Eigen::Vector2d expected = projected_by_bisection(p.scene.device, place - motion) - here;
      ASSERT_NEAR(x.at<float>(row, column), expected.x(), 2e-4);
      ASSERT_NEAR(y.at<float>(row, column), expected.y(), 2e-4);
      least = std::min(least, expected.norm());
      most = std::max(most, expected.norm());
    }
  }
  EXPECT_GT(most, 1.1 * least) << "the distortion makes it uneven";
}

// k1 = -0.3 turns the picture back at a tangent of 1.05: beyond that the bare formula gives points of the picture.
TEST(LensTruth, WhatLiesBeyondTheDistortionsFoldHasNoFlow) {
  const PlayedTruth& p = bare();
  SeenGeometry seen = seen_of(p, p.truths.front().press);
  for (Eigen::Vector3d& rest : seen.sheet.rest) rest.x() -= 40.0;
  DeviceSpec device = p.scene.device;
  const cv::Mat folded = channel(pixel_truth(seen, lens_of(device), all_layers()), "flow.X");
  EXPECT_EQ(cv::countNonZero(folded == folded), 0) << "NaN is unlike itself";
  std::get<LensSpec>(device.camera->optics).distortion.clear();
  const cv::Mat plain = channel(pixel_truth(seen, lens_of(device), all_layers()), "flow.X");
  EXPECT_EQ(cv::countNonZero(plain < -200.0f), 160 * 120);
}

TEST(LensTruth, PixelsThatLookNowhereSeeNothing) {
  const PlayedTruth& p = bare();
  const SeenGeometry seen = seen_of(p, p.truths.front().press);
  // Made ready for a small picture, then asked for a larger one, whose rim the distortion doesn't reach.
  render::LensCamera lens = lens_of(p.scene.device);
  lens.distortion.k1 = -1.5;
  EXPECT_THROW(pixel_truth(seen, lens, all_layers()), Error);
  const render::DistortionReach reach = render::radial_reach(lens.distortion);
  const render::PreparedLens ready{lens, render::sensor_distance_mm(lens), reach};
  const auto hits = render::first_hits(seen.inside, ready);
  int nothing = 0;
  for (int row = 0; row < 120; ++row) {
    for (int column = 0; column < 160; ++column) {
      const double r = std::hypot((column - lens.matrix.cx) / lens.matrix.fx, (row - lens.matrix.cy) / lens.matrix.fy);
      const bool seen_here = hits[static_cast<std::size_t>(row * 160 + column)].object >= 0;
      if (r > reach.distorted) {
        ++nothing;
        ASSERT_FALSE(seen_here);
      } else if (r < 0.9 * reach.distorted) {
        ASSERT_TRUE(seen_here);
      }
    }
  }
  EXPECT_GT(nothing, 100);
}

// Turned by a quarter about its axis, the camera sees the same in a turned picture: layer by layer, and its frames.
TEST(LensTruth, ARolledCamerasLayersAreTurnedAsItsPictureIs) {
  const PlayedTruth& p = pressed_truth();
  const SeenGeometry seen = seen_of(p, p.truths.back().press);
  DeviceSpec device = p.scene.device;
  make_lens(*device.camera);
  std::get<LensSpec>(device.camera->optics).distortion.clear();
  device.camera->width = device.camera->height = 120;
  const double focal = 5.0 / 0.018;
  std::get<LensSpec>(device.camera->optics).camera_matrix = Eigen::Vector4d(focal, focal, 59.5, 59.5);
  const LinearImage upright = pixel_truth(seen, camera_of(*device.camera), all_layers());
  device.camera->roll_deg = 90.0;
  const LinearImage rolled = pixel_truth(seen, camera_of(*device.camera), all_layers());
  for (const char* layer : {"depth.Z", "contact.Y"}) {
    cv::Mat turned;
    cv::rotate(channel(upright, layer), turned, cv::ROTATE_90_COUNTERCLOCKWISE);
    const cv::Mat differs = cv::abs(channel(rolled, layer) - turned) > 1e-4;
    EXPECT_LT(cv::countNonZero(differs), 0.002 * 120 * 120) << layer;  // rays that meet edges
  }
  // Flow is of the picture: what went to the right goes up in one that is turned.
  EXPECT_GT(cv::norm(channel(upright, "flow.X"), cv::NORM_INF), 0.1);
  cv::Mat x, y;
  cv::rotate(channel(upright, "flow.X"), x, cv::ROTATE_90_COUNTERCLOCKWISE);
  cv::rotate(channel(upright, "flow.Y"), y, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Mat wrong_x = cv::abs(channel(rolled, "flow.X") - y) > 1e-3;
  const cv::Mat wrong_y = cv::abs(channel(rolled, "flow.Y") + x) > 1e-3;
  EXPECT_LT(cv::countNonZero(wrong_x), 0.002 * 120 * 120);
  EXPECT_LT(cv::countNonZero(wrong_y), 0.002 * 120 * 120);
}

}  // namespace
}  // namespace touchstone::sim
