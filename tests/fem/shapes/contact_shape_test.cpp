#include "fem/shapes/contact_shape.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"

namespace touchstone::fem {
namespace {

TriangleMesh box_mesh(const Eigen::Vector3d& size) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k) {
    mesh.vertices.emplace_back((k & 1 ? 0.5 : -0.5) * size.x(), (k & 2 ? 0.5 : -0.5) * size.y(),
                               (k & 4 ? 0.5 : -0.5) * size.z());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// A cylinder of many sides with a rounded lower rim, as a mesh.
TriangleMesh lathe(const RoundedCylinder& shape, int sides, int arc) {
  std::vector<Eigen::Vector2d> profile;  // radius, z from the flat face's middle to the top's middle
  for (int k = 0; k <= arc; ++k) {
    const double angle = 0.5 * kPi * k / arc;
    profile.emplace_back(shape.radius - shape.edge_radius * (1.0 - std::sin(angle)),
                         shape.edge_radius * (1.0 - std::cos(angle)));
  }
  profile.emplace_back(shape.radius, shape.height);
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  mesh.vertices.emplace_back(0, 0, shape.height);
  for (const auto& p : profile) {
    for (int s = 0; s < sides; ++s) {
      const double angle = 2.0 * kPi * s / sides;
      mesh.vertices.emplace_back(p.x() * std::cos(angle), p.x() * std::sin(angle), p.y());
    }
  }
  const int rings = static_cast<int>(profile.size());
  for (int s = 0; s < sides; ++s) {
    const int next = (s + 1) % sides;
    mesh.triangles.push_back({0, 2 + next, 2 + s});
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = 2 + r * sides + s, b = 2 + r * sides + next, c = a + sides, d = b + sides;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
    const int top = 2 + (rings - 1) * sides;
    mesh.triangles.push_back({1, top + s, top + next});
  }
  return mesh;
}

Eigen::Vector3d random_direction(RandomStream& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

TEST(FirstEntry, OfASphereIsOnItsNearSide) {
  RandomStream random(1, 0, Purpose::kTest);
  const SphereShape sphere{2.0};
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d p = 1.5 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const auto t = first_entry(sphere, p, d);
    const double away = (p - p.dot(d) * d).norm();
    ASSERT_EQ(t.has_value(), away <= 2.0);
    if (!t) continue;
    const Eigen::Vector3d hit = p + *t * d;
    EXPECT_NEAR(hit.norm(), 2.0, 1e-13);
    EXPECT_LE(hit.dot(d), 1e-12);
  }
}

/// A shape of each kind.
std::vector<ContactShape> one_of_each() {
  return {SphereShape{1.0},
          RoundedCylinder{1.0, 0.3, 2.0},
          BoxShape{{1.0, 2.0, 3.0}},
          MeshShape(box_mesh({1.0, 2.0, 3.0})),
          EggShape{1.0, 1.2, 1.5},
          EggShape{2.0, 0.4, 0.7},
          ShellShape{{3.0, 2.0}, 0.2, {0.4, -0.3}},
          ConeShape{0.5, 2.0, 0.0},
          ConeShape{1.2, 0.8, 1.5},
          ConeShape{0.3, 1.0, 0.9},
          TorusShape{1.5, 0.4},
          BarShape{0.7, 3.0, false},
          BarShape{0.7, 3.0, true}};
}

TEST(FirstEntry, DoesNotDependOnWhereTheLineStarts) {
  RandomStream random(2, 0, Purpose::kTest);
  for (const ContactShape& shape : one_of_each()) {
    for (int k = 0; k < 100; ++k) {
      const Eigen::Vector3d d = random_direction(random);
      const Eigen::Vector3d p = 0.5 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const auto near = first_entry(shape, p, d);
      const auto far = first_entry(shape, p - 30.0 * d, d);
      ASSERT_EQ(near.has_value(), far.has_value());
      if (near) {
        EXPECT_NEAR(*far - 30.0, *near, 1e-10);
      }
    }
  }
}

TEST(FirstEntry, GrazingASphereApproachesItsMiddle) {
  const SphereShape sphere{1.0};
  for (const double miss : {1e-3, 1e-6, 1e-9, 1e-12}) {
    const auto t = first_entry(sphere, {1.0 - miss, 0, 5}, {0, 0, -1});
    ASSERT_TRUE(t.has_value());
    EXPECT_NEAR(*t, 5.0 - std::sqrt(2.0 * miss), 1e-3 * std::sqrt(miss) + 1e-7);
    EXPECT_FALSE(first_entry(sphere, {1.0 + miss, 0, 5}, {0, 0, -1}).has_value());
  }
}

TEST(FirstEntry, OfABoxIsThatOfItsMesh) {
  RandomStream random(3, 0, Purpose::kTest);
  const Eigen::Vector3d size(1.0, 2.0, 0.5);
  const BoxShape box{size};
  const MeshShape mesh(box_mesh(size));
  int hits = 0;
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d p = 0.6 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const auto a = first_entry(box, p, d);
    const auto b = first_entry(mesh, p, d);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    ++hits;
    EXPECT_NEAR(*a, *b, 1e-11);
  }
  EXPECT_GT(hits, 100);
}

TEST(FirstEntry, LinesThroughEdgesAndVerticesOfAMeshHit) {
  const MeshShape mesh(box_mesh({2.0, 2.0, 2.0}));
  for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    for (const double y : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
      const auto t = first_entry(mesh, {x, y, 0.0}, {0, 0, 1});
      ASSERT_TRUE(t.has_value()) << x << ' ' << y;
      EXPECT_NEAR(*t, -1.0, 1e-14);
    }
  }
  EXPECT_FALSE(first_entry(mesh, {1.0 + 1e-9, 0.0, 0.0}, {0, 0, 1}).has_value());
}

TEST(FirstEntry, OfARoundedCylinderAlongItsAxisIsClosedForm) {
  const RoundedCylinder cylinder{3.0, 0.5, 4.0};
  for (const double rho : {0.0, 1.0, 2.5}) {
    EXPECT_NEAR(*first_entry(cylinder, {0, rho, -1.0}, {0, 0, 1}), 1.0, 1e-15);
  }
  for (const double beyond : {0.125, 0.25, 0.375, 0.5}) {
    const double z = 0.5 - std::sqrt(0.25 - beyond * beyond);
    EXPECT_NEAR(*first_entry(cylinder, {2.5 + beyond, 0, 0}, {0, 0, 1}), z, 1e-15);
  }
  EXPECT_FALSE(first_entry(cylinder, {3.0 + 1e-12, 0, 0}, {0, 0, 1}).has_value());
  EXPECT_NEAR(*first_entry(cylinder, {1.0, 0, 9.0}, {0, 0, -1}), 5.0, 1e-15);
}

TEST(FirstEntry, OfARoundedCylinderIsThatOfAFineMesh) {
  RandomStream random(4, 0, Purpose::kTest);
  const RoundedCylinder cylinder{1.0, 0.4, 1.5};
  const MeshShape mesh(lathe(cylinder, 256, 48));
  int rim = 0;
  for (int k = 0; k < 600; ++k) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d p(0.6 * random.normal(), 0.6 * random.normal(), 0.4 * random.normal());
    const auto exact = first_entry(cylinder, p, d);
    const auto faceted = first_entry(mesh, p, d);
    if (faceted) {
      ASSERT_TRUE(exact.has_value());  // the mesh lies inside
      EXPECT_LE(*exact, *faceted + 1e-9);
      const Eigen::Vector3d hit = p + *exact * d;
      rim += hit.z() > 0.01 && hit.z() < 0.39 && std::hypot(hit.x(), hit.y()) > 0.61;
      // Facets lie within 1e-4 below the surface; grazing lines see them later.
      const Eigen::Vector3d seen = p + *faceted * d;
      EXPECT_LT(*faceted - *exact, 0.05) << hit.transpose() << " / " << seen.transpose();
    }
  }
  EXPECT_GT(rim, 20);
}

TEST(FirstEntry, OnTheRoundedRimIsAtTheEdgeRadiusFromTheCore) {
  RandomStream random(5, 0, Purpose::kTest);
  const RoundedCylinder cylinder{2.0, 0.7, 3.0};
  int rim = 0;
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d p(2.0 * random.normal(), random.normal(), 0.5 * random.normal());
    const auto t = first_entry(cylinder, p, d);
    if (!t) continue;
    const Eigen::Vector3d hit = p + *t * d;
    const double out = std::hypot(hit.x(), hit.y()) - 1.3;
    const double below = 0.7 - hit.z();
    if (out <= 0.0 || below <= 0.0) continue;
    ++rim;
    EXPECT_NEAR(std::hypot(out, below), 0.7, 1e-12);
  }
  EXPECT_GT(rim, 200);
}

/// Also where a line all but touches the rim: a place is moved across the line until it changes from hit to miss, and
/// at the last hits and misses both must agree, too.
TEST(IsHit, IsWhetherThereIsAnEntry) {
  RandomStream random(6, 0, Purpose::kTest);
  int crossings = 0;
  for (const double edge : {0.0, 0.02, 0.7, 2.0}) {
    const RoundedCylinder cylinder{2.0, edge, 3.0};
    for (int k = 0; k < 400; ++k) {
      const Eigen::Vector3d d = random_direction(random);
      Eigen::Vector3d hit(random.normal(), random.normal(), 1.5 + 0.5 * random.normal());
      if (!first_entry(cylinder, hit, d)) continue;
      EXPECT_TRUE(is_hit(cylinder, hit, d));
      Eigen::Vector3d miss = hit + 10.0 * d.cross(random_direction(random)).normalized();
      EXPECT_FALSE(is_hit(cylinder, miss, d));
      for (int bisection = 0; bisection < 40; ++bisection) {
        const Eigen::Vector3d middle = 0.5 * (hit + miss);
        const bool is = first_entry(cylinder, middle, d).has_value();
        ASSERT_EQ(is_hit(cylinder, middle, d), is) << bisection;
        (is ? hit : miss) = middle;
      }
      ++crossings;
    }
  }
  EXPECT_GT(crossings, 800);
}

TEST(CheckShape, RefusesImpossibleSizes) {
  EXPECT_THROW(check_shape(SphereShape{0.0}), Error);
  EXPECT_THROW(check_shape(SphereShape{std::numeric_limits<double>::quiet_NaN()}), Error);
  EXPECT_THROW(check_shape(SphereShape{std::numeric_limits<double>::infinity()}), Error);
  EXPECT_THROW(check_shape(RoundedCylinder{1.0, 1.1, 2.0}), Error);
  EXPECT_THROW(check_shape(RoundedCylinder{1.0, -0.1, 2.0}), Error);
  EXPECT_THROW(check_shape(BoxShape{{1.0, -1.0, 1.0}}), Error);
  EXPECT_NO_THROW(check_shape(RoundedCylinder{1.0, 0.0, 2.0}));
}

TEST(MeshShape, RefusesAnOpenMesh) {
  TriangleMesh open = box_mesh({1, 1, 1});
  open.triangles.pop_back();
  EXPECT_THROW(MeshShape{open}, Error);
}

TEST(BoundingBall, HoldsEachEntryPoint) {
  RandomStream random(6, 0, Purpose::kTest);
  for (const ContactShape& shape : one_of_each()) {
    const BoundingBall ball = bounding_ball(shape);
    for (int k = 0; k < 200; ++k) {
      const Eigen::Vector3d d = random_direction(random);
      const Eigen::Vector3d p = Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      if (const auto t = first_entry(shape, p, d)) {
        EXPECT_LE((p + *t * d - ball.centre).norm(), ball.radius + 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace touchstone::fem
