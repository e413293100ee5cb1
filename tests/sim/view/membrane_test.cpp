#include "sim/view/membrane.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <opencv2/core.hpp>

#include "fem/mesh/slab.h"
#include "sim/plan/plan.h"
#include "sim/press/play_motion.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {
namespace {

const char* const kDevice = R"(name: small
gel: {size_x_mm: 10, size_y_mm: 10, thickness_mm: 3, youngs_modulus_MPa: 0.3}
mesh: {fine_mm: 0.6, coarse_mm: 1.5, fine_half_extent_mm: [3, 3], fine_depth_mm: 0.6}
plate: {thickness_mm: 1, refractive_index: 1.5}
)";

SceneSpec scene_with(const std::string& relief) {
  SceneSpec scene;
  scene.device = parse_yaml<DeviceSpec>(kDevice, "device.yaml");
  scene.object = parse_yaml<ObjectSpec>(
      "name: a\nshape: {type: rounded_cylinder, radius_mm: 2, edge_radius_mm: 0.2, height_mm: 3}\n" + relief, "o.yaml");
  scene.motion = parse_yaml<MotionSpec>("start_mm: [0, 0, 1]\nkeys:\n  - {frames: 1, z: {position_mm: -0.15}}\n", "m");
  scene.outputs = {.frames = false, .ideal = false, .radiance = false, .height = true};
  return scene;
}

const fem::Compliance& gel() {
  static const fem::Compliance compliance =
      fem::compute_compliance(fem::mesh_slab({10.0, 10.0, 3.0, 0.6, 1.5, 3.0, 3.0, 0.6}), {0.3, 0.49}, {}, 3.0);
  return compliance;
}

const char* const kWaves = "relief: {type: waves, amplitude_um: 20, pitch_mm: 0.4}\n";

TEST(Membrane, WithTheEffectOffNoFineContactIsSolved) {
  SceneSpec scene = scene_with(kWaves);
  scene.effects.fine_relief = Switch::off;
  const Plan plan = make_plan(scene);
  const auto truths = play_motion(scene, plan, gel());
  const Membrane membrane(scene, plan, gel());
  EXPECT_FALSE(membrane.relief(truths.back().press));
  // The coarse height is still there.
  const cv::Mat height = membrane.height(truths.back().press, std::nullopt);
  EXPECT_EQ(height.size(), cv::Size(300, 300));
  EXPECT_NEAR(height.at<float>(150, 150), -0.15 - 0.01, 0.01);
}

TEST(Membrane, TheImprintOfWavesIsInTheHeightMap) {
  const SceneSpec scene = scene_with(kWaves);
  const Plan plan = make_plan(scene);
  ASSERT_TRUE(plan.fine_relief);
  const auto truths = play_motion(scene, plan, gel());
  const Membrane membrane(scene, plan, gel());
  const auto relief = membrane.relief(truths.back().press);
  ASSERT_TRUE(relief);
  const cv::Mat height = membrane.height(truths.back().press, relief);
  // Crests (deepest) at odd multiples of 0.2 mm; pixel i is at 0.02 (i + 0.5) - 3.
  const auto at = [&](double x) { return height.at<float>(150, static_cast<int>((x + 3.0) / 0.02)); };
  EXPECT_LT(at(0.2), at(0.0) - 0.003);
  EXPECT_LT(at(-0.2), at(-0.4) - 0.003);
  EXPECT_NEAR(at(0.2), at(0.6), 1e-3);
  // A membrane never reaches into the body: z of the face less the waves, from where the fine contact put it.
  const double face = truths.back().press.gel_from_object.translation.z() + relief->solved.shift;
  EXPECT_NEAR(at(0.2), face - 0.02, 2e-3);
  EXPECT_LE(at(0.0), face + 1e-4);
}

TEST(Membrane, BeforeTheTouchTheHeightIsZero) {
  const SceneSpec scene = scene_with(kWaves);
  const Plan plan = make_plan(scene);
  const auto truths = play_motion(scene, plan, gel());
  const Membrane membrane(scene, plan, gel());
  const auto relief = membrane.relief(truths.front().press);
  EXPECT_EQ(cv::countNonZero(membrane.height(truths.front().press, relief)), 0);
}

TEST(Membrane, TheSheetIsWholeAndItsWetPartLiesOnTheObject) {
  const SceneSpec scene = scene_with(kWaves);
  const Plan plan = make_plan(scene);
  const auto truths = play_motion(scene, plan, gel());
  const Membrane membrane(scene, plan, gel());
  const auto relief = membrane.relief(truths.back().press);
  const Membrane::Sheet sheet = membrane.sheet(truths.back().press, *relief);
  ASSERT_FALSE(sheet.wet.triangles.empty());
  // Each edge is in two triangles of opposite sense, but for the sheet's own border.
  std::map<std::pair<int, int>, int> edges;
  for (const auto* part : {&sheet.dry, &sheet.wet}) {
    for (const auto& t : part->triangles) {
      for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    }
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    if (edges.contains({edge.second, edge.first})) continue;
    const Eigen::Vector2d middle = 0.5 * (sheet.dry.vertices[edge.first] + sheet.dry.vertices[edge.second]).head<2>();
    EXPECT_GT(middle.cwiseAbs().maxCoeff(), 4.9);
  }
  const fem::ContactShape shape = contact_shape(scene.object);
  RigidTransform pose = truths.back().press.gel_from_object;
  pose.translation.z() += relief->solved.shift;
  double worst = 0.0;
  for (const auto& t : sheet.wet.triangles) {
    for (const int v : t) {
      const auto gap = fem::first_entry(shape, pose.inverse() * sheet.wet.vertices[v], Eigen::Vector3d::UnitZ());
      ASSERT_TRUE(gap);
      worst = std::max(worst, std::abs(*gap));
    }
  }
  EXPECT_LT(worst, 1e-4);
}

TEST(Membrane, WherePixelsEndOnTheGelsEdgeTheSheetHasNoFolds) {
  // A pixel's middle on the gel's edge but for rounding, a fifth of a pixel inside of it, and a fifth beyond it.
  for (const double pixel_mm : {0.08, 10.0 / 125.4, 10.0 / 124.6}) {
    SceneSpec scene = scene_with(kWaves);
    scene.membrane.pixel_um = 1e3 * pixel_mm;
    scene.motion.start_mm = {4, 0, 1};
    const Plan plan = make_plan(scene);
    const auto truths = play_motion(scene, plan, gel());
    const Membrane membrane(scene, plan, gel());
    const auto relief = membrane.relief(truths.back().press);
    ASSERT_TRUE(relief);
    ASSERT_GT(relief->grid.first.x() + relief->grid.pitch * (relief->grid.nx - 1), 4.9) << "the pixels reach the edge";
    const Membrane::Sheet sheet = membrane.sheet(truths.back().press, *relief);
    double least = 1.0, most = -1.0;  // signed areas: of one sense, and none of them 0
    for (const auto* part : {&sheet.dry, &sheet.wet}) {
      for (const auto& t : part->triangles) {
        const auto at = [&](int k) -> Eigen::Vector2d { return sheet.dry.vertices[t[k]].head<2>(); };
        const Eigen::Vector2d ab = at(1) - at(0), ac = at(2) - at(0);
        const double area = 0.5 * (ab.x() * ac.y() - ab.y() * ac.x());
        least = std::min(least, area), most = std::max(most, area);
      }
    }
    EXPECT_GT(least * most, 0.0) << "pixels of " << pixel_mm << " mm: " << least << " to " << most << " mm^2";
    EXPECT_GT(std::min(std::abs(least), std::abs(most)), 1e-6);
  }
}

TEST(Membrane, RefusesAHeightMapWithoutEnd) {
  SceneSpec scene = scene_with(kWaves);
  scene.membrane.height_size_mm = Eigen::Vector2d(900, 1);
  EXPECT_THROW(Membrane(scene, make_plan(scene), gel()), Error);
}

}  // namespace
}  // namespace touchstone::sim
