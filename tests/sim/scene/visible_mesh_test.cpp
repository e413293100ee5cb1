#include <gtest/gtest.h>

#include <cmath>

#include "core/units.h"
#include "sim/scene/object.h"

namespace touchstone::sim {
namespace {

ShapeSpec sphere(double radius) {
  ShapeSpec shape;
  shape.type = ShapeKind::sphere;
  shape.radius_mm = radius;
  return shape;
}

ShapeSpec cylinder(double radius, double edge, double height) {
  ShapeSpec shape;
  shape.type = ShapeKind::rounded_cylinder;
  shape.radius_mm = radius;
  shape.edge_radius_mm = edge;
  shape.height_mm = height;
  return shape;
}

ShapeSpec egg(double radius, double blunt, double sharp) {
  ShapeSpec shape;
  shape.type = ShapeKind::egg;
  shape.radius_mm = radius;
  shape.blunt_mm = blunt;
  shape.sharp_mm = sharp;
  return shape;
}

ShapeSpec shell(const Eigen::Vector2d& axes, double thickness, const Eigen::Vector2d& curvature) {
  ShapeSpec shape;
  shape.type = ShapeKind::shell;
  shape.axes_mm = axes;
  shape.thickness_mm = thickness;
  shape.curvature_per_mm = curvature;
  return shape;
}

ShapeSpec hexagon(double across_flats, double length) {
  ShapeSpec shape;
  shape.type = ShapeKind::hexagon;
  shape.across_flats_mm = across_flats;
  shape.length_mm = length;
  return shape;
}

TEST(VisibleMesh, EachShapeIsASolid) {
  ShapeSpec box;
  box.type = ShapeKind::box;
  box.size_mm = {1, 2, 3};
  for (const ShapeSpec& shape :
       {sphere(2), cylinder(3, 0.3, 6), cylinder(3, 0, 6), cylinder(3, 3, 6), cylinder(2, 2, 2), box, egg(22, 25, 32),
        shell({60, 40}, 1.7, {0.02, -0.02}), shell({60, 40}, 0.3, {0, 0}), hexagon(6.5, 35.5)}) {
    EXPECT_EQ(fault_of_closed_mesh(visible_mesh(shape)), "");
  }
  EXPECT_EQ(fault_of_closed_mesh(visible_mesh(ScreenSpec{15, 6, {0.5, 0.5, 0.5}})), "");
}

TEST(VisibleMesh, VolumesAreThoseOfTheSolids) {
  EXPECT_NEAR(enclosed_volume(visible_mesh(sphere(2))), 4.0 / 3 * kPi * 8, 0.005 * 4.0 / 3 * kPi * 8);
  EXPECT_NEAR(enclosed_volume(visible_mesh(cylinder(3, 0, 6))), kPi * 9 * 6, 0.005 * kPi * 9 * 6);
  ShapeSpec box;
  box.type = ShapeKind::box;
  box.size_mm = {1, 2, 3};
  EXPECT_NEAR(enclosed_volume(visible_mesh(box)), 6.0, 1e-12);
  EXPECT_NEAR(enclosed_volume(visible_mesh(hexagon(2, 3))), 2.0 * std::sqrt(3.0) * 3, 1e-12);
  EXPECT_NEAR(flat_width_mm(hexagon(6.5, 35.5)), 3.7528, 1e-4);
  EXPECT_NEAR(enclosed_volume(visible_mesh(egg(2, 2.5, 3))), 2.0 / 3 * kPi * 4 * 5.5, 0.005 * 2.0 / 3 * kPi * 4 * 5.5);
  EXPECT_NEAR(enclosed_volume(visible_mesh(shell({6, 4}, 0.2, {0.1, -0.2}))), kPi * 6 * 0.2, 0.005 * kPi * 6 * 0.2);
}

// The contact solver and the camera must see the same body: where a line enters the one, it enters the other.
TEST(VisibleMesh, ItIsTheBodyThatTheContactSolverFeels) {
  for (const ShapeSpec& shape :
       {cylinder(3, 0.5, 6), egg(3.5, 4, 5), shell({7, 8}, 0.5, {0.1, -0.2}), hexagon(6.5, 8)}) {
    const auto contact = contact_shape(shape);
    const fem::ContactShape seen = fem::MeshShape(visible_mesh(shape));
    for (double r = 0.05; r < 2.95; r += 0.1) {
      const Eigen::Vector3d below(r * 0.6, r * 0.8, -7.0);
      const auto a = fem::first_entry(contact, below, Eigen::Vector3d::UnitZ());
      const auto b = fem::first_entry(seen, below, Eigen::Vector3d::UnitZ());
      ASSERT_TRUE(a && b) << r;
      EXPECT_NEAR(*a, *b, 0.01) << r;
    }
  }
}

}  // namespace
}  // namespace touchstone::sim
