#include "sim/view/pixel_truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <set>

#include "core/error.h"
#include "render/cameras/first_hits.h"
#include "sim/scene/device_camera.h"
#include "tests/sim/view/pixel_truth_scene.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

/// What holds through a hole and through a lens (the parameter: is it a lens?).
class PixelTruthOf : public ::testing::TestWithParam<bool> {
 protected:
  static SceneSpec seen_by(SceneSpec scene) {
    if (GetParam()) make_lens(*scene.device.camera);
    return scene;
  }
};
INSTANTIATE_TEST_SUITE_P(Cameras, PixelTruthOf, ::testing::Bool(),
                         [](const auto& of) { return of.param ? "Lens" : "Pinhole"; });

TEST_P(PixelTruthOf, AFlatGelIsAtItsTrueDepthAndDoesNotFlow) {
  SceneSpec scene = seen_by(truth_scene("  - {frames: 1, z: {position_mm: 4.4}}\n"));
  scene.device.beads.reset();
  const Capture capture = PlayedTruth(scene).last();
  EXPECT_TRUE(capture.frame.empty());
  EXPECT_EQ(capture.paths_traced, 0) << "no light is asked for";
  const cv::Mat depth = channel(capture.pixel_truth, "depth.Z"), ids = channel(capture.pixel_truth, "id.ID");
  const cv::Mat x = channel(capture.pixel_truth, "flow.X"), nz = channel(capture.pixel_truth, "normal.Z");
  int gel = 0;
  for (int row = 0; row < 120; ++row) {
    for (int column = 0; column < 160; ++column) {
      if (ids.at<float>(row, column) != PixelId::kGel) continue;
      ++gel;
      ASSERT_NEAR(depth.at<float>(row, column), 18.0, 1e-4) << "the true place, not the raised image";
      ASSERT_NEAR(x.at<float>(row, column), 0.0, 1e-3);
      ASSERT_NEAR(nz.at<float>(row, column), 1.0, 1e-6);
    }
  }
  // The picture's half height at the gel: 1.08 mm on the sensor 5 mm behind the hole, bent in plate and gel.
  EXPECT_EQ(gel, 160 * 120);
}

TEST_P(PixelTruthOf, BeadsAreCountedAndFlowAsTheirDisplacementSays) {
  PlayedTruth p = pressed_truth();
  p.scene = seen_by(p.scene);
  const Capture capture = p.last();
  const cv::Mat ids = channel(capture.pixel_truth, "id.ID");
  const cv::Mat x = channel(capture.pixel_truth, "flow.X"), y = channel(capture.pixel_truth, "flow.Y");
  std::set<int> beads;
  double largest = 0.0;
  const std::vector<Eigen::Vector3d> rest = bead_centres(*p.scene.device.beads);
  for (int k = 0; k < 4; ++k) {
    // The bead's point that faces the camera on the plumb line of its centre.
    const Eigen::Vector3d was = rest[static_cast<std::size_t>(k)] - Eigen::Vector3d(0, 0, 0.3);
    const Eigen::Vector3d is = was + p.truths.back().press.bead_displacement.row(k).transpose();
    const Eigen::Vector2d here = projected_by_bisection(p.scene.device, is);
    const Eigen::Vector2d expected = projected_by_bisection(p.scene.device, was) - here;
    const int column = static_cast<int>(here.x()), row = static_cast<int>(here.y());
    EXPECT_EQ(ids.at<float>(row, column), PixelId::kFirstBead + k);
    EXPECT_NEAR(x.at<float>(row, column), expected.x(), 0.05);
    EXPECT_NEAR(y.at<float>(row, column), expected.y(), 0.05);
    largest = std::max(largest, expected.norm());
  }
  EXPECT_GT(largest, 0.3) << "the beads move far enough to tell";
  for (int row = 0; row < ids.rows; ++row) {
    for (int column = 0; column < ids.cols; ++column) {
      const int id = static_cast<int>(ids.at<float>(row, column));
      if (id >= PixelId::kFirstBead) beads.insert(id);
    }
  }
  EXPECT_EQ(beads, (std::set<int>{10000, 10001, 10002, 10003}));
}

TEST(PixelTruth, TheContactIsWhereTheObjectIsAndAsLargeAsTruthHasIt) {
  const PlayedTruth& p = pressed_truth();
  const LinearImage truth = p.last().pixel_truth;
  const cv::Mat contact = channel(truth, "contact.Y"), ids = channel(truth, "id.ID");
  const cv::Mat nx = channel(truth, "normal.X"), ny = channel(truth, "normal.Y"), nz = channel(truth, "normal.Z");
  const Eigen::Vector3d centre = p.truths.back().press.gel_from_object.translation;
  // A pixel's size on the gel, from the apparent depth on the axis.
  const double apparent = 13.0 + 1.0 / 1.5 + 4.0 / 1.45;
  const double pixel = 0.018 * apparent / 5.0;
  int count = 0;
  double worst = 0.0;
  const cv::Mat depth = channel(truth, "depth.Z");
  for (int row = 0; row < 120; ++row) {
    for (int column = 0; column < 160; ++column) {
      const bool touches = contact.at<float>(row, column) == 1.0f;
      ASSERT_EQ(touches, ids.at<float>(row, column) == PixelId::kFirstObject);
      if (!touches) continue;
      ++count;
      // Depth gives z (the camera looks along +z); the sphere's underside has its normal there.
      const double z = depth.at<float>(row, column) - 18.0;
      const double across = std::hypot(nx.at<float>(row, column), ny.at<float>(row, column));
      const double rise = std::sqrt(std::max(0.0, 16.0 - std::pow(centre.z() - z, 2))) / 4.0;
      if (rise < 0.2) worst = std::max(worst, std::abs(across - rise));
    }
  }
  const double area = count * pixel * pixel;
  const double wanted = p.truths.back().press.contact_area;
  const double radius = std::sqrt(wanted / 3.141592653589793);
  // Truth's area is a sum of the vertices' weights: its own rim is half an edge (0.4 mm) wide; ours a pixel.
  EXPECT_NEAR(std::sqrt(area / 3.141592653589793), radius, 0.4 + pixel);
  EXPECT_GT(count, 300);
  EXPECT_LT(worst, 0.05) << "the imprint's slope is the sphere's";
  EXPECT_LT(nz.at<float>(60, 80), 1.0001f);
}

TEST(PixelTruth, ItIsTheSameBytesOnAnyNumberOfThreadsAndRoundTripsAsExr) {
  const PlayedTruth& p = pressed_truth();
  const LinearImage many = p.last().pixel_truth;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const LinearImage alone = p.last().pixel_truth;
  ASSERT_EQ(many.image.total(), alone.image.total());
  EXPECT_EQ(std::memcmp(many.image.data, alone.image.data, many.image.total() * many.image.elemSize()), 0);
  const test::TemporaryFolder folder;
  write_exr(folder.path() / "t.exr", many.image, many.channel_names);
  const LinearImage back = read_exr(folder.path() / "t.exr");
  EXPECT_EQ(std::set<std::string>(back.channel_names.begin(), back.channel_names.end()),
            std::set<std::string>(many.channel_names.begin(), many.channel_names.end()));
  const cv::Mat a = channel(many, "depth.Z"), b = channel(back, "depth.Z");
  EXPECT_EQ(std::memcmp(a.data, b.data, a.total() * 4), 0);
}

TEST(PixelTruth, OnlyWhatIsAskedForIsMade) {
  SceneSpec scene = truth_scene("  - {frames: 1, z: {position_mm: 3.8}}\n");
  scene.outputs = parse_yaml<OutputSpec>("{frames: false, error: true, flow: true}", "outputs.yaml");
  const Capture capture = PlayedTruth(scene).last();
  EXPECT_EQ(capture.pixel_truth.channel_names, (std::vector<std::string>{"flow.X", "flow.Y", "error.irradiance"}));
  const cv::Mat error = channel(capture.pixel_truth, "error.irradiance");
  EXPECT_GT(cv::countNonZero(error > 0.0f), 160 * 120 / 2);
  EXPECT_GT(capture.paths_traced, 0);
  scene.outputs = parse_yaml<OutputSpec>("{frames: false}", "outputs.yaml");
  EXPECT_FALSE(make_plan(scene).camera);
}

TEST(PixelTruth, ADeviceWithoutACameraIsRefused) {
  SceneSpec scene = truth_scene("  - {frames: 1, z: {position_mm: 4.4}}\n");
  scene.device.camera.reset();
  scene.outputs = parse_yaml<OutputSpec>("{frames: false, depth: true}", "outputs.yaml");
  try {
    make_plan(scene);
    FAIL() << "depth needs a camera";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no camera"));
  }
}

TEST_P(PixelTruthOf, ProjectionIsTheInverseOfEveryHitOfATiltedCamera) {
  const PlayedTruth& p = pressed_truth();
  SceneSpec scene = seen_by(p.scene);
  scene.device.camera->position_mm = {3.0, -2.0, -16.0};
  const std::vector<VisibleObject> objects = visible_objects(scene);
  const SeenGeometry seen = seen_geometry(scene, make_plan(scene), objects, VisibleGel(*p.gel), p.truths.back().press);
  const render::ReadyCamera camera = render::make_ready(camera_of(*scene.device.camera));
  const std::vector<render::FirstHit> hits = render::first_hits(seen.inside, camera);
  int checked = 0;
  for (std::size_t i = 0; i < hits.size(); i += 7) {
    if (hits[i].object < 0) continue;
    const auto back = render::project_through_faces(seen.inside, camera, hits[i].position);
    ASSERT_TRUE(back);
    EXPECT_NEAR(back->x(), static_cast<double>(i % 160) + 0.5, 2e-4);
    EXPECT_NEAR(back->y(), static_cast<double>(i / 160) + 0.5, 2e-4);
    ++checked;
  }
  EXPECT_GT(checked, 1000);
}

TEST(FirstHits, APointBehindTheCameraIsNotSeen) {
  const render::PinholeCamera camera = pinhole_camera(*pressed_truth().scene.device.camera);
  render::Scene scene;
  scene.environment = render::flat_spectrum(3, 0.0);
  EXPECT_FALSE(render::project_through_faces(scene, camera, {0, 0, -19}));
  EXPECT_TRUE(render::project_through_faces(scene, camera, {0, 0, -17}));
}

}  // namespace
}  // namespace touchstone::sim
