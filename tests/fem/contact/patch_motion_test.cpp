#include "fem/contact/patch_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "fem/elements/surface_strain.h"

namespace touchstone::fem {
namespace {

struct Patch {
  std::vector<Eigen::Vector3d> points, normals, displacements;
  std::vector<double> weights;
};

Patch random_patch(int count) {
  RandomStream random(11, 0, Purpose::kTest);
  Patch patch;
  for (int k = 0; k < count; ++k) {
    patch.points.emplace_back(random.normal(), random.normal(), 0.0);
    patch.normals.push_back(Eigen::Vector3d::UnitZ());
    patch.weights.push_back(random.uniform());
  }
  return patch;
}

TEST(PatchMotion, FindsARigidMotionExactly) {
  Patch patch = random_patch(20);
  const Eigen::Vector3d shift(0.3, -0.2, 0.0);
  const Eigen::AngleAxisd turn(0.4, Eigen::Vector3d::UnitZ());
  for (const auto& p : patch.points) patch.displacements.push_back(turn * p + shift - p);
  const PatchMotion motion = mean_patch_motion(patch.points, patch.normals, patch.displacements, patch.weights);
  EXPECT_NEAR(motion.spin, 0.4, 1e-14);
  for (std::size_t k = 0; k < patch.points.size(); ++k) {
    EXPECT_LT((motion.displacement(patch.points[k]) - patch.displacements[k]).norm(), 1e-14);
  }
}

// A third vertex that begins to bear mustn't turn the patch at once: presses with two or three of them went to and fro.
TEST(PatchMotion, TheThirdPointsWeightBringsTheSpin) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Eigen::Vector3d> normals(3, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector3d> displacements;
  for (const auto& p : points) displacements.emplace_back(-0.1 * p.y(), 0.1 * p.x(), 0.0);
  double last = 0.0;
  for (const double third : {0.0, 1e-9, 0.01, 0.1, 0.5, 1.0}) {
    const std::vector<double> weights = {1.0, 1.0, third};
    const double spin = mean_patch_motion(points, normals, displacements, weights).spin;
    EXPECT_GE(spin, last);
    EXPECT_LE(spin - last, 0.25 * third);
    last = spin;
  }
  EXPECT_NEAR(last, std::atan(0.1), 1e-14);
}

TEST(PatchMotion, IgnoresStretchAndSinking) {
  Patch patch = random_patch(40);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double sum = 0.0;
  for (std::size_t k = 0; k < patch.points.size(); ++k) {
    centre += patch.weights[k] * patch.points[k];
    sum += patch.weights[k];
  }
  centre /= sum;
  for (const auto& p : patch.points) patch.displacements.push_back(0.3 * (p - centre) - Eigen::Vector3d(0, 0, 0.7));
  const PatchMotion motion = mean_patch_motion(patch.points, patch.normals, patch.displacements, patch.weights);
  EXPECT_LT(motion.translation.norm(), 1e-14);
  EXPECT_NEAR(motion.spin, 0.0, 1e-14);
}

TEST(PatchMotion, OfNothingIsNone) {
  const PatchMotion motion = mean_patch_motion({}, {}, {}, {});
  EXPECT_EQ(motion.displacement({1, 2, 3}).norm(), 0.0);
  const std::vector<Eigen::Vector3d> one = {Eigen::Vector3d::UnitX()};
  const std::vector<double> nothing = {0.0};
  EXPECT_EQ(mean_patch_motion(one, one, one, nothing).displacement({1, 2, 3}).norm(), 0.0);
}

TEST(SurfaceGradient, IsTheLargestSingularValueOfALinearField) {
  const std::vector<Eigen::Vector3d> vertices = {{0, 0, 0}, {1, 0, 0}, {0.3, 2, 0}};
  const std::vector<std::array<int, 3>> triangles = {{0, 1, 2}};
  Eigen::MatrixX3d displacement(3, 3);
  for (int v = 0; v < 3; ++v)
    displacement.row(v) = Eigen::RowVector3d(0.1 * vertices[v].x(), 0.0, 0.3 * vertices[v].y());
  EXPECT_NEAR(largest_surface_gradient(vertices, triangles, displacement), 0.3, 1e-14);
  EXPECT_NEAR(largest_surface_gradient(vertices, triangles, 2.0 * displacement), 0.6, 1e-14);
  displacement.rowwise() = Eigen::RowVector3d(1, 2, 3);
  EXPECT_NEAR(largest_surface_gradient(vertices, triangles, displacement), 0.0, 1e-14);
}

}  // namespace
}  // namespace touchstone::fem
