// Hits on sheets by their index, against a ray tree on the same triangles.

#include "render/scene/sheet_index.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "render/cameras/still_view.h"
#include "render/scene/ray_scene.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

/// Walls, folds that hide what is behind them, and triangles of many sizes: lines crowd in the middle.
TriangleMesh rough_sheet() {
  TriangleMesh mesh = square_relief(5.0, 120, [](double, double) { return 0.0; });
  for (Eigen::Vector3d& v : mesh.vertices) {
    v.x() *= std::abs(v.x()) / 5.0;
    v.y() *= std::abs(v.y()) / 5.0;
    v.z() = -0.5 * std::exp(-v.head<2>().squaredNorm()) - 0.3 * std::tanh(40.0 * (v.x() - 1.0)) +
            0.05 * std::sin(25.0 * v.y());
  }
  return mesh;
}

Scene scene_of(const TriangleMesh& sheet) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({sheet, Black{}});
  return scene;
}

/// Rays at random from below: each `period`-th up to as flat as `flat`, the others as `steep`, mm across a mm of
/// height.
struct DrawnRays {
  unsigned seed;
  int count;
  double from_z;
  int period;
  double flat, steep;
};

/// How many met the sheet, all as the tree says.
int rays_met(const Scene& scene, const DrawnRays& rays) {
  const RayScene tree(scene);
  const SheetIndex index(scene.surfaces[0], {Eigen::Vector2d(-10, -10), Eigen::Vector2d(10, 10)});
  std::mt19937 random(rays.seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int met = 0;
  for (int k = 0; k < rays.count; ++k) {
    const Eigen::Vector3d origin(6.0 * unit(random), 6.0 * unit(random), rays.from_z);
    const double across = k % rays.period == 0 ? rays.flat : rays.steep;
    const Eigen::Vector3d direction = Eigen::Vector3d(across * unit(random), across * unit(random), 1.0).normalized();
    RayHit expected;
    const bool hits = tree.intersect(origin, direction, 100.0, expected);
    const auto found = index.first(origin, direction, 100.0);
    EXPECT_EQ(found.has_value(), hits) << k;
    if (!hits || !found) continue;
    ++met;
    EXPECT_NEAR(found->distance, expected.distance, 2e-5) << k;
    const Eigen::Vector3d normal = normals_at(index.surface(), *found).face.normalized();
    if (found->triangle == expected.triangle) {
      EXPECT_LT((normal - expected.normal).norm(), 1e-9);
    }
    EXPECT_FALSE(index.first(origin, direction, found->distance - 1e-6)) << k;
  }
  return met;
}

TEST(SheetIndex, RaysMeetWhatTheTreeSays) {
  EXPECT_GT(rays_met(scene_of(rough_sheet()), {3, 40000, -4.0, 4, 8.0, 0.8}), 15000);  // from steep to nearly level
}

// Rays less steep than some of its slopes, which reach 1, meet it up to three times.
TEST(SheetIndex, AHeightFieldIsMetFirstByFlatRaysToo) {
  const TriangleMesh mesh = square_relief(5.0, 150, [](double x, double y) {
    return 0.4 * std::sin(2.5 * x) * std::cos(1.5 * y) - 0.1 * std::exp(-4.0 * (x * x + y * y));
  });
  EXPECT_GT(rays_met(scene_of(mesh), {5, 20000, -2.0, 3, 4.0, 0.6}), 10000);
}

TEST(SheetIndex, NothingIsMetBesideWhatIsSeenOrOfNothing) {
  const Surface sheet{rough_sheet(), Black{}};
  const SheetIndex part(sheet, {Eigen::Vector2d(-1, -1), Eigen::Vector2d(0, 0)});
  EXPECT_TRUE(part.first({-0.5, -0.5, -4}, {0, 0, 1}, 10.0));
  EXPECT_FALSE(part.first({2.5, 2.5, -4}, {0, 0, 1}, 10.0));
  const SheetIndex beside(sheet, {Eigen::Vector2d(20, 20), Eigen::Vector2d(21, 21)});
  EXPECT_FALSE(beside.first({20.5, 20.5, -4}, {0, 0, 1}, 10.0));
  const Surface none{{}, Black{}};
  EXPECT_FALSE(SheetIndex(none, {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1)}).first({0, 0, -4}, {0, 0, 1}, 10.0));
}

// A camera below glass and gel, walls round the sheet, one of them before it: what first_hits says, pixel by pixel.
TEST(StillView, AMovedSheetIsSeenAsFirstHitsSeesIt) {
  Scene scene = sensor_stack(0.0);
  scene.surfaces.push_back({rough_sheet(), Black{}});
  TriangleMesh wall;
  wall.vertices = {{-5, -2.5, -4.9}, {5, -2.5, -4.9}, {5, -2.0, 1}, {-5, -2.0, 1}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.surfaces.push_back({wall, Black{}});
  PinholeCamera pinhole;
  pinhole.width = 160;
  pinhole.height = 120;
  pinhole.pixel_pitch_um = 36.0;
  pinhole.distance_mm = 5.0;
  pinhole.gel_from_camera.translation = {0.3, 0.2, -16.0};
  const ReadyCamera camera = make_ready(pinhole);
  const StillView view(scene, camera);
  for (const double depth : {0.0, 0.7}) {
    for (Eigen::Vector3d& v : scene.surfaces[0].mesh.vertices) v.z() -= depth * std::exp(-v.head<2>().squaredNorm());
    const std::vector<FirstHit> expected = first_hits(scene, camera);
    const std::vector<FirstHit> found = view.first_hits(scene.surfaces[0]);
    ASSERT_EQ(found.size(), expected.size());
    int on_sheet = 0;
    int on_wall = 0;
    for (std::size_t k = 0; k < found.size(); ++k) {
      ASSERT_EQ(found[k].object, expected[k].object) << k;
      on_sheet += found[k].object == 0;
      on_wall += found[k].object == 1;
      if (found[k].object < 0) continue;
      EXPECT_LT((found[k].position - expected[k].position).norm(), 5e-5) << k;
      if (found[k].triangle == expected[k].triangle) {
        EXPECT_LT((found[k].normal - expected[k].normal).norm(), 1e-4) << k;
      }
    }
    // With what another search found: right of most pixels, of every ninth another triangle, of every tenth unknown.
    std::vector<std::int32_t> known(found.size(), -1);
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (expected[k].object == 0 && k % 10 != 0) known[k] = expected[k].triangle;
      if (k % 9 == 0) known[k] = static_cast<std::int32_t>(k % scene.surfaces[0].mesh.triangles.size());
    }
    const std::vector<FirstHit> by_known = view.first_hits(scene.surfaces[0], known);
    for (std::size_t k = 0; k < found.size(); ++k) {
      ASSERT_EQ(by_known[k].object, expected[k].object) << k;
      if (found[k].object < 0) continue;
      EXPECT_LT((by_known[k].position - found[k].position).norm(), 5e-5) << k;
    }
    EXPECT_GT(on_sheet, 3000);
    EXPECT_GT(on_wall, 300);
  }
}

}  // namespace
}  // namespace touchstone::render
