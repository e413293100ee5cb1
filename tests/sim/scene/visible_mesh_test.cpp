#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/random.h"
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

ShapeSpec cone(double half_angle_deg, double height, double tip_radius) {
  ShapeSpec shape;
  shape.type = ShapeKind::cone;
  shape.half_angle_deg = half_angle_deg;
  shape.height_mm = height;
  shape.tip_radius_mm = tip_radius;
  return shape;
}

ShapeSpec torus(double radius, double tube_radius) {
  ShapeSpec shape;
  shape.type = ShapeKind::torus;
  shape.radius_mm = radius;
  shape.tube_radius_mm = tube_radius;
  return shape;
}

ShapeSpec bar(ShapeKind kind, double radius, double length) {
  ShapeSpec shape;
  shape.type = kind;
  shape.radius_mm = radius;
  shape.length_mm = length;
  return shape;
}

ShapeSpec wedge(double half_angle_deg, double height, double length) {
  ShapeSpec shape = cone(half_angle_deg, height, 0.0);
  shape.type = ShapeKind::wedge;
  shape.length_mm = length;
  return shape;
}

std::vector<ShapeSpec> cones_tori_and_bars() {
  return {cone(30, 5, 0),
          cone(30, 5, 1.2),
          cone(80, 1, 3),
          torus(3, 0.5),
          torus(1, 0.95),
          bar(ShapeKind::capsule, 1, 6),
          bar(ShapeKind::capsule, 1, 2),
          bar(ShapeKind::lying_cylinder, 1, 6),
          wedge(45, 2, 7)};
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
  for (const ShapeSpec& shape : cones_tori_and_bars()) EXPECT_EQ(fault_of_closed_mesh(visible_mesh(shape)), "");
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

TEST(VisibleMesh, VolumesOfConesToriAndBarsAreThoseOfTheSolids) {
  const auto near = [](const ShapeSpec& shape, double wanted) {
    EXPECT_NEAR(enclosed_volume(visible_mesh(shape)), wanted, 0.006 * wanted);
  };
  const double base = 5.0 / std::sqrt(3.0);
  near(cone(30, 5, 0), kPi / 3 * base * base * 5);
  near(torus(3, 0.5), 2 * kPi * kPi * 3 * 0.25);
  near(bar(ShapeKind::capsule, 1, 6), kPi * 4 + 4.0 / 3 * kPi);
  near(bar(ShapeKind::lying_cylinder, 1, 6), kPi * 6);
  EXPECT_NEAR(enclosed_volume(visible_mesh(wedge(45, 2, 7))), 4.0 * 7, 1e-12);
}

/// By random lines. The coarsest circles of these meshes have 48 sides, which lie up to 1 - cos(pi / 48) of a radius
/// below them; grazing lines see them later, others earlier: on average no later than that.
TEST(VisibleMesh, RandomLinesEnterConesToriAndBarsWhereTheyEnterTheSolverBody) {
  RandomStream random(1, 0, Purpose::kTest);
  for (const ShapeSpec& shape : cones_tori_and_bars()) {
    const fem::ContactShape contact = contact_shape(shape);
    const fem::MeshShape seen(visible_mesh(shape));
    const fem::BoundingBall ball = fem::bounding_ball(contact);
    int hits = 0, apart = 0;
    double sum = 0.0;
    for (int k = 0; k < 1000; ++k) {
      const Eigen::Vector3d d = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      const Eigen::Vector3d p =
          ball.centre + 0.3 * ball.radius * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const auto a = fem::first_entry(contact, p, d);
      const auto b = fem::first_entry(seen, p, d);
      if (a.has_value() != b.has_value()) {
        ++apart;
      } else if (a) {
        ++hits;
        sum += std::min(std::abs(*a - *b), 0.1 * ball.radius);
      }
    }
    EXPECT_GT(hits, 200) << static_cast<int>(shape.type);
    EXPECT_LT(apart, 10) << static_cast<int>(shape.type);
    EXPECT_LT(sum / hits, (1.0 - std::cos(kPi / 48)) * ball.radius) << static_cast<int>(shape.type);
  }
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
