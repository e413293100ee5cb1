#include "sim/press/press_spec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/transform.h"
#include "core/units.h"
#include "sim/press/first_touch.h"
#include "tests/support/message_of.h"

namespace touchstone::sim {
namespace {

using test::message_of;
using ::testing::HasSubstr;

ObjectSpec ball(double radius_mm) {
  ObjectSpec object;
  object.name = "ball";
  object.shape.radius_mm = radius_mm;
  return object;
}

GelSpec slab() {
  GelSpec gel;
  gel.shape = SlabSpec{.size_x_mm = 20.0, .size_y_mm = 20.0};
  gel.thickness_mm = 4.0;
  return gel;
}

// A ball over a plane touches at its radius, on a dome where the two spheres touch: sqrt((R + r)^2 - x^2) - R.
TEST(PressSpec, FirstTouchIsExactForSpheres) {
  EXPECT_DOUBLE_EQ(first_touch({.place_mm = {1, 2}}, ball(3), slab()), 3.0);
  GelSpec dome;
  dome.shape = DomeSpec{.sphere_radius_mm = 20.0, .base_radius_mm = 8.0};
  EXPECT_NEAR(first_touch({.place_mm = {4, 3}}, ball(3), dome), std::sqrt(23.0 * 23.0 - 25.0) - 20.0, 1e-6);
}

TEST(PressSpec, AnglesBeyondATurnAreRefused) {
  EXPECT_EQ(message_of([] { check({.angles_deg = {0, 0, -360}, .force_N = 1.0}); }), "no error");
  EXPECT_THAT(message_of([] {
                check({.angles_deg = {1e308, 0, 0}, .force_N = 1.0});
              }),
              HasSubstr("angles_deg has 1e+308; allowed is from -360 to 360"));
}

// The rim of a flat disc of radius a, tilted by t, is a sin t below its middle.
TEST(PressSpec, FirstTouchOfATiltedDiscIsItsRim) {
  ObjectSpec disc = ball(0);
  disc.shape.type = ShapeKind::rounded_cylinder;
  disc.shape.radius_mm = 2.0;
  disc.shape.height_mm = 3.0;
  for (const double tilt_deg : {0.5, 3.0, 10.0, 25.0}) {
    EXPECT_NEAR(first_touch({.angles_deg = {tilt_deg, 0, 0}}, disc, slab()),
                2.0 * std::sin(tilt_deg * kRadiansPerDegree), 1e-5)
        << tilt_deg;
  }
}

// Closed forms of the lowest point, however the body is turned: the mesh that the camera sees has almost the same.
TEST(PressSpec, FirstTouchOfConesToriAndBarsIsTheirMeshs) {
  ShapeSpec cone;
  cone.type = ShapeKind::cone;
  cone.half_angle_deg = 35.0;
  cone.height_mm = 3.0;
  cone.tip_radius_mm = 0.5;
  ShapeSpec sharp = cone;
  sharp.tip_radius_mm = 0.0;
  ShapeSpec torus;
  torus.type = ShapeKind::torus;
  torus.radius_mm = 2.0;
  torus.tube_radius_mm = 0.4;
  ShapeSpec capsule;
  capsule.type = ShapeKind::capsule;
  capsule.radius_mm = 0.7;
  capsule.length_mm = 4.0;
  ShapeSpec cylinder = capsule;
  cylinder.type = ShapeKind::lying_cylinder;
  for (const ShapeSpec& shape : {cone, sharp, torus, capsule, cylinder}) {
    const fem::ContactShape exact = contact_shape(shape);
    const fem::ContactShape seen = fem::MeshShape(visible_mesh(shape));
    for (const double x : {0.0, 3.0, 20.0, 50.0, 80.0, 100.0, 170.0}) {
      for (const double y : {0.0, -7.0, 30.0, 60.0}) {
        const Eigen::Matrix3d turned = rotation_from_xyz(Eigen::Vector3d(x, y, 0.0) * kRadiansPerDegree);
        const double touch = first_touch(slab(), exact, {0.5, -1.0}, turned);
        EXPECT_NEAR(touch, first_touch(slab(), seen, {0.5, -1.0}, turned), 0.004) << x << ' ' << y;
      }
    }
  }
  EXPECT_EQ(first_touch(slab(), contact_shape(sharp), {0, 0}, Eigen::Matrix3d::Identity()), 0.0);
  EXPECT_EQ(first_touch(slab(), contact_shape(torus), {0, 0}, Eigen::Matrix3d::Identity()), 0.4);
  EXPECT_EQ(first_touch(slab(), contact_shape(capsule), {0, 0}, Eigen::Matrix3d::Identity()), 0.7);
}

TEST(PressSpec, FirstTouchOfAReliefIsItsHighestPlace) {
  ObjectSpec disc = ball(0);
  disc.shape.type = ShapeKind::rounded_cylinder;
  disc.shape.radius_mm = 4.25;
  disc.shape.edge_radius_mm = 0.1;
  disc.shape.height_mm = 6.0;
  EXPECT_DOUBLE_EQ(first_touch({.place_mm = {1, 2}}, disc, slab()), 0.0);
  disc.relief = ReliefSpec{WavesRelief{40.0, 0.5}};
  EXPECT_NEAR(first_touch({.place_mm = {1, 2}}, disc, slab()), 0.04, 1e-5);
}

// A ball over the pad's edge touches with its flank: sqrt(R^2 - d^2), d from the edge.
TEST(PressSpec, FirstTouchBesideThePadIsAFlank) {
  EXPECT_NEAR(first_touch({.place_mm = {10.9, 0}}, ball(1.5), slab()), std::sqrt(1.5 * 1.5 - 0.81), 1e-3);
  EXPECT_THAT(message_of([] {
                first_touch({.place_mm = {12, 0}}, ball(1.5), slab());
              }),
              HasSubstr("isn't over the gel"));
}

TEST(PressSpec, DepthsCountFromTheFirstTouch) {
  const MotionSpec motion = press_motion({.place_mm = {1, 0}, .depth_mm = 0.3}, 3.0, 0.0, 30.0);
  EXPECT_GT(motion.start_mm.z(), 3.0);
  ASSERT_EQ(motion.keys.size(), 1u);
  EXPECT_DOUBLE_EQ(motion.keys[0].z->position_mm.value(), 2.7);
  EXPECT_EQ(motion.frame_count(), 2);
}

TEST(PressSpec, StepsWhereFrictionHasAHistory) {
  const auto frames = [](const PressSpec& press, double friction) {
    return press_motion(press, 3.0, friction, 30.0).frame_count() - 1;
  };
  EXPECT_EQ(frames({.force_N = 1}, 0.5), 1);
  EXPECT_EQ(frames({.angles_deg = {5, 0, 0}, .force_N = 1}, 0.0), 1);
  EXPECT_EQ(frames({.angles_deg = {5, 0, 0}, .depth_mm = 0.1}, 0.5), 3);
  EXPECT_EQ(frames({.angles_deg = {5, 0, 0}, .force_N = 1}, 0.5), 1) << "fem takes a touch led by force in parts";
  EXPECT_EQ(frames({.angles_deg = {0, 0, 90}, .force_N = 1}, 0.5), 1) << "a turn about z goes straight in";
  EXPECT_EQ(frames({.force_N = 1, .drag_mm = {0.3, 0.4}}, 0.5), 1 + 3) << "0.5 mm in steps of 0.2 at most";
  EXPECT_EQ(frames({.force_N = 1, .shear_N = Eigen::Vector2d(0.1, 0)}, 0.5), 1 + 5);
}

TEST(PressSpec, SecondsAreOfEachPart) {
  const MotionSpec motion = press_motion({.force_N = 1, .drag_mm = {0.5, 0}, .seconds = 2.0}, 3.0, 0.5, 30.0);
  for (const MotionKey& key : motion.keys) EXPECT_DOUBLE_EQ(key.frames / motion.frame_rate_Hz, 2.0);
}

TEST(PressSpec, WhatMakesNoSenseIsRefused) {
  const auto refused = [](const PressSpec& press) { return message_of([&] { check(press); }); };
  EXPECT_THAT(refused({}), HasSubstr("none of force_N, depth_mm and height_mm"));
  EXPECT_THAT(refused({.force_N = 1, .height_mm = 0}), HasSubstr("several of"));
  EXPECT_THAT(refused({.force_N = 0}), HasSubstr("force_N is 0"));
  EXPECT_THAT(refused({.depth_mm = std::nan("")}), HasSubstr("depth_mm is nan"));
  EXPECT_THAT(refused({.depth_mm = 1, .drag_mm = {INFINITY, 0}}), HasSubstr("must be finite"));
  EXPECT_THAT(refused({.depth_mm = 1, .drag_mm = {1, 0}, .shear_N = Eigen::Vector2d(1, 0)}), HasSubstr("both drag_mm"));
  EXPECT_THAT(refused({.depth_mm = 1, .seconds = -1}), HasSubstr("seconds is -1"));
}

// Any rotation comes back from its angles.
TEST(PressSpec, AnglesOfARotation) {
  for (const Eigen::Vector3d& angles : {Eigen::Vector3d(0.1, -0.4, 2.5), Eigen::Vector3d(-1.2, 1.3, -3.0)}) {
    EXPECT_LT((xyz_from_rotation(rotation_from_xyz(angles)) - angles).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace touchstone::sim
