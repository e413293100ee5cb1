#include "sim/view/visible_gel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace touchstone::sim {
namespace {

constexpr int kSide = 21;      // vertices a side
constexpr double kStep = 0.5;  // mm
constexpr double kHalf = 5.0;  // mm

/// An outer surface of 10 x 10 mm with a regular mesh. Its mass matrix is lumped: means over hats are the values.
fem::Compliance flat_pad() {
  fem::Compliance gel;
  gel.thickness = 4.0;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      gel.vertices.emplace_back(column * kStep - kHalf, row * kStep - kHalf, 0.0);
    }
  }
  for (int row = 0; row + 1 < kSide; ++row) {
    for (int column = 0; column + 1 < kSide; ++column) {
      const int a = row * kSide + column;
      gel.triangles.push_back({a, a + 1, a + kSide});
      gel.triangles.push_back({a + 1, a + kSide + 1, a + kSide});
    }
  }
  gel.mass.resize(kSide * kSide, kSide * kSide);
  gel.mass.setIdentity();
  return gel;
}

fem::PressState at_rest(const fem::Compliance& gel) {
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  fem::PressState press;
  press.gel_from_object.translation = {0, 0, 10};
  press.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
  press.node_state.assign(gel.vertices.size(), fem::NodeState::open);
  return press;
}

/// The surface pressed by a body down to `height(x, y)` where that is below zero; contact where it lies.
template <typename Height>
fem::PressState pressed(const fem::Compliance& gel, const Height& height) {
  fem::PressState press = at_rest(gel);
  for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
    const double z = height(gel.vertices[i].x(), gel.vertices[i].y());
    if (z > 0.0) continue;
    press.surface_displacement(static_cast<Eigen::Index>(i), 2) = z;
    press.node_state[i] = fem::NodeState::stick;
  }
  return press;
}

double area_of(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d ab = mesh.vertices[t[1]] - mesh.vertices[t[0]];
    const Eigen::Vector3d ac = mesh.vertices[t[2]] - mesh.vertices[t[0]];
    area += 0.5 * ab.head<2>().x() * ac.y() - 0.5 * ab.y() * ac.x();
  }
  return area;
}

TEST(VisibleGel, AtRestIsTheWholeFlatFaceInFinerTriangles) {
  const fem::Compliance gel = flat_pad();
  const TriangleMesh mesh = VisibleGel(gel).dry_surface(at_rest(gel), fem::SphereShape{2.0});
  EXPECT_EQ(mesh.triangles.size(), 16 * gel.triangles.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    EXPECT_NEAR(vertex.z(), 0.0, 1e-14);
    EXPECT_LE(vertex.head<2>().cwiseAbs().maxCoeff(), kHalf + 1e-12);
  }
  EXPECT_NEAR(area_of(mesh), 4.0 * kHalf * kHalf, 1e-9);
}

TEST(VisibleGel, KeepsAnAffineDisplacementExactly) {
  const fem::Compliance gel = flat_pad();
  fem::PressState press = at_rest(gel);
  for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
    const Eigen::Vector3d& p = gel.vertices[i];
    press.surface_displacement.row(static_cast<Eigen::Index>(i)) << 0.1, -0.05, 0.02 * p.x() - 0.03 * p.y();
  }
  const TriangleMesh mesh = VisibleGel(gel).dry_surface(press, fem::SphereShape{1.0});
  for (const Eigen::Vector3d& v : mesh.vertices) {
    EXPECT_NEAR(v.z(), 0.02 * (v.x() - 0.1) - 0.03 * (v.y() + 0.05), 1e-12);
  }
}

// Each of two punches wets its own disc, at its own depth.
TEST(VisibleGel, TwoPunchesWetTwoDiscs) {
  const fem::Compliance gel = flat_pad();
  const fem::RoundedCylinder punch{1.5, 0.0, 4.0};
  const RigidTransform left{Eigen::Matrix3d::Identity(), {-2.5, 0, -0.1}};
  const RigidTransform right{Eigen::Matrix3d::Identity(), {2.5, 0, -0.3}};
  fem::PressState press = at_rest(gel);
  press.node_owner.assign(gel.vertices.size(), -1);
  for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
    const Eigen::Vector3d& p = gel.vertices[i];
    const int owner = (p - left.translation).head<2>().norm() <= 1.5    ? 0
                      : (p - right.translation).head<2>().norm() <= 1.5 ? 1
                                                                        : -1;
    if (owner < 0) continue;
    press.node_owner[i] = owner;
    press.node_state[i] = fem::NodeState::stick;
    // A little off the bodies: the surface is laid onto them.
    press.surface_displacement(static_cast<Eigen::Index>(i), 2) = owner == 0 ? -0.12 : -0.25;
  }
  const fem::ContactShape shape = punch;
  const PlacedShape bodies[] = {{shape, left}, {shape, right}};
  const TriangleMesh mesh = VisibleGel(gel).dry_surface(press, bodies);
  // To within a fine triangle, a quarter of a step, all round both rims.
  const double rims = 2.0 * 2.0 * 3.14159 * 1.5;
  EXPECT_NEAR(4.0 * kHalf * kHalf - area_of(mesh), 0.5 * 1.5 * rims, 0.25 * kStep * rims);
  // What is left of the surface at a rim is at that body's depth.
  double deepest_left = 0.0;
  double deepest_right = 0.0;
  for (const auto& t : mesh.triangles) {
    for (const int v : t) {
      double& deepest = mesh.vertices[v].x() < 0.0 ? deepest_left : deepest_right;
      deepest = std::min(deepest, mesh.vertices[v].z());
    }
  }
  EXPECT_NEAR(deepest_left, -0.1, 1e-9);
  EXPECT_NEAR(deepest_right, -0.3, 1e-9);
}

// What is left out is the disc that the punch wets, to within a fine triangle at its rim, and not the many-cornered
// union of whole elements.
TEST(VisibleGel, AFlatPunchWetsADisc) {
  const fem::Compliance gel = flat_pad();
  const double radius = 2.6;
  const double depth = 0.4;
  const fem::RoundedCylinder punch{radius, 0.1, 5.0};
  fem::PressState press =
      pressed(gel, [&](double x, double y) { return std::hypot(x, y) < radius - 0.1 ? -depth : 1.0; });
  press.gel_from_object.translation = {0, 0, -depth};
  const TriangleMesh mesh = VisibleGel(gel).dry_surface(press, punch);
  double nearest = 1e9;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d centre = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0;
    nearest = std::min(nearest, centre.head<2>().norm());
  }
  EXPECT_GT(nearest, radius - 0.25) << "the wetted disc has a hole or a dent";
  const double wet = 4.0 * kHalf * kHalf - area_of(mesh);
  EXPECT_NEAR(wet, 3.14159 * radius * radius, 0.1 * 3.14159 * radius * radius);
}

TEST(VisibleGel, NowhereReachesIntoTheBody) {
  const fem::Compliance gel = flat_pad();
  const double radius = 4.0;
  const double depth = 0.5;
  const fem::SphereShape ball{radius};
  fem::PressState press = pressed(gel, [&](double x, double y) {
    const double r2 = x * x + y * y;
    return r2 < radius * radius ? radius - depth - std::sqrt(radius * radius - r2) : 1.0;
  });
  press.gel_from_object.translation = {0, 0, radius - depth};
  const TriangleMesh mesh = VisibleGel(gel).dry_surface(press, ball);
  const Eigen::Vector3d centre(0, 0, radius - depth);
  for (const auto& t : mesh.triangles) {
    for (int corner : t) EXPECT_GE((mesh.vertices[corner] - centre).norm(), radius - 1e-9);
  }
}

}  // namespace
}  // namespace touchstone::sim
