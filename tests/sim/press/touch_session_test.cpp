#include "sim/press/touch_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "sim/press/first_touch.h"
#include "sim/press/gel_setup.h"
#include "tests/support/message_of.h"
#include "tests/support/small_scene.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kRadius_mm = 2.0;
constexpr double kFriction = 0.4;

const DeviceSpec& device() {
  static const DeviceSpec one = test::small_device();
  return one;
}

/// Made once: the gel's set-up takes longest.
const fem::Compliance& gel() {
  static const test::TemporaryFolder cache;
  static const auto one = set_up_gel(device(), cache.path());
  return *one;
}

fem::PressBody ball(double friction = kFriction) {
  return {fem::SphereShape{kRadius_mm}, friction, nullptr};
}

TouchSession session(const TouchSessionSettings& settings = {}) {
  return {gel(), device().gel, ball(), settings};
}

RigidTransform at(double x, double y, double z) {
  RigidTransform pose;
  pose.translation = {x, y, z};
  return pose;
}

TEST(TouchSession, TellsWhatAPressTellsToTheBit) {
  TouchSession one = session();
  fem::PressTolerance tolerance;
  tolerance.largest_motion = TouchSessionSettings{}.largest_part_mm;
  fem::Press press(gel(), fem::SphereShape{kRadius_mm}, kFriction, tolerance);
  for (const RigidTransform& pose : {at(0, 0, 2.1), at(0, 0, 1.7), at(0.25, 0, 1.65), at(0.2, 0.1, 1.7)}) {
    fem::PressTarget target;
    for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(pose.translation[a]);
    target.seconds = 0.01;
    const fem::PressState& wanted = press.step(target);
    const TouchReading& reading = one.step(pose, 0.01);
    EXPECT_EQ(reading.wrench, wanted.wrench);
    const fem::PressState state = one.press();
    EXPECT_EQ(state.traction, wanted.traction);
    EXPECT_EQ(state.surface_displacement, wanted.surface_displacement);
    EXPECT_EQ(state.bead_displacement, wanted.bead_displacement);
    EXPECT_EQ(state.largest_strain, wanted.largest_strain);
    EXPECT_EQ(one.error(state).displacement, fem::estimate_error(gel(), wanted).displacement);
    EXPECT_EQ(reading.error.force, fem::estimate_error(gel(), wanted).force);
  }
  EXPECT_EQ(one.reading().step, 4);
  EXPECT_NEAR(one.reading().t_s, 0.04, 1e-15);
}

TEST(TouchSession, AContactSticksThenSlipsInPartThenSlidesAtItsFriction) {
  TouchSession one = session();
  EXPECT_EQ(one.step(at(0.5, -0.3, 2.5), 0.01).contact, TouchContact::none);
  const TouchReading pressed = one.step(at(0.5, -0.3, 1.6), 0.01);
  EXPECT_NE(pressed.contact, TouchContact::none);
  EXPECT_LT((pressed.centre_mm.head<2>() - Eigen::Vector2d(0.5, -0.3)).norm(), 0.15) << "within a mesh edge";
  EXPECT_GT(pressed.wrench[2], 0.0);
  double last_share = 0.0;
  bool partly = false;
  TouchReading dragged;
  for (int k = 1; k <= 80 && dragged.contact != TouchContact::sliding; ++k) {
    dragged = one.step(at(0.5 + 0.025 * k, -0.3, 1.6), 0.01);
    const double ratio = dragged.wrench.head<2>().norm() / dragged.wrench[2];
    EXPECT_LE(ratio, kFriction * (1 + 1e-6));
    EXPECT_LT(dragged.wrench[0], 0.0) << "the gel holds the object back";
    if (dragged.contact == TouchContact::partly_slipping) {
      partly = true;
      EXPECT_GT(dragged.slipping_share, 0.0);
      EXPECT_LT(dragged.slipping_share, 1.0);
      EXPECT_GE(dragged.slipping_share, last_share - 0.1) << "slip spreads from the rim";
      last_share = dragged.slipping_share;
    }
  }
  EXPECT_TRUE(partly);
  ASSERT_EQ(dragged.contact, TouchContact::sliding);
  EXPECT_NEAR(dragged.wrench.head<2>().norm() / dragged.wrench[2], kFriction, 0.01 * kFriction)
      << "less than all of it, since not every vertex slides in quite the same direction";
}

TEST(TouchSession, AResultDependsOnThePath) {
  TouchSession dragged = session(), direct = session();
  for (const RigidTransform& pose : {at(-0.2, 0, 1.6), at(0, 0, 1.6)}) dragged.step(pose, 0.01);
  direct.step(at(0, 0, 1.6), 0.01);
  EXPECT_LT(dragged.reading().wrench[0], -0.01);
  EXPECT_NEAR(direct.reading().wrench[0], 0.0, 1e-3);
  dragged.restart();
  EXPECT_EQ(dragged.reading().step, 0);
  dragged.step(at(0, 0, 1.6), 0.01);
  EXPECT_EQ(dragged.reading().wrench, direct.reading().wrench);
}

TEST(TouchSession, RefusesABadStepAndStaysAsItWas) {
  TouchSession one = session(), undisturbed = session();
  for (TouchSession* each : {&one, &undisturbed}) each->step(at(0, 0, 1.7), 0.01);
  const auto refusal = [&](const RigidTransform& pose, double seconds = 0.01) {
    return test::message_of([&] { one.step(pose, seconds); });
  };
  RigidTransform scaled = at(0, 0, 1.7);
  scaled.rotation *= 1.1;
  EXPECT_THAT(refusal(scaled), HasSubstr("rotation isn't one"));
  RigidTransform mirrored = at(0, 0, 1.7);
  mirrored.rotation(0, 0) = -1.0;
  EXPECT_THAT(refusal(mirrored), HasSubstr("det R = -1"));
  EXPECT_THAT(refusal(at(std::nan(""), 0, 1.7)), HasSubstr("must be finite"));
  EXPECT_THAT(refusal(at(0, 0, -2.5)), HasSubstr("mm into a gel of 4 mm"));
  EXPECT_THAT(refusal(at(8, 0, 1.7)), HasSubstr("goes 8 mm in one step"));
  EXPECT_THAT(refusal(at(0, 0, 1.6), 0.0), HasSubstr("takes 0 s; allowed is a finite time above 0"));
  EXPECT_THAT(refusal(at(0, 0, 1.6), INFINITY), HasSubstr("takes inf s"));
  EXPECT_EQ(one.reading().step, 1);
  for (TouchSession* each : {&one, &undisturbed}) each->step(at(0.1, 0, 1.65), 0.01);
  EXPECT_LT((one.reading().wrench - undisturbed.reading().wrench).norm(), 1e-7) << "gaps may be looked up anew";
  EXPECT_EQ(one.step(at(0, 0, 60), 0.01).contact, TouchContact::none) << "lifting off may be fast";
  EXPECT_THAT(test::message_of([] { session({.largest_step_mm = -1}); }), HasSubstr("largest_step_mm"));
  EXPECT_THAT(test::message_of([] { session({.largest_part_mm = 0}); }), HasSubstr("largest_part_mm"));
}

TEST(TouchSession, AGelThatRelaxesForgetsItsForceAndKeepsItsSurface) {
  GelSpec relaxing = device().gel;
  relaxing.relaxation = {{0.4, 0.1}};
  TouchSession one(gel(), relaxing, ball());
  const double at_once = one.step(at(0, 0, 1.6), 1e-6).wrench[2];
  double later = 0.0;
  for (int k = 0; k < 100; ++k) later = one.step(at(0, 0, 1.6), 0.01).wrench[2];
  EXPECT_NEAR(later / at_once, 0.6, 0.001);
  TouchSession elastic = session();
  elastic.step(at(0, 0, 1.6), 0.01);
  const Eigen::MatrixX3d relaxed = one.press().surface_displacement, wanted = elastic.press().surface_displacement;
  EXPECT_LT((relaxed - wanted).norm(), 1e-3 * wanted.norm());
}

TEST(TouchHeight, IsThatOfClosedForms) {
  const Eigen::Matrix3d level = Eigen::Matrix3d::Identity();
  EXPECT_NEAR(first_touch(device().gel, fem::SphereShape{2.5}, {1, 2}, level), 2.5, 1e-6);
  const double tilt = 0.3;
  const Eigen::Matrix3d tilted = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
  EXPECT_NEAR(first_touch(device().gel, fem::BoxShape{{2, 3, 1}}, {0, 0}, tilted),
              1.5 * std::sin(tilt) + 0.5 * std::cos(tilt), 1e-3);
  // Half of the ball beside the gel: what is over its edge touches at the ball's lowest line there.
  EXPECT_NEAR(first_touch(device().gel, fem::SphereShape{2.0}, {7, 0}, level), std::sqrt(3.0), 1e-3);
  GelSpec dome;
  dome.shape = DomeSpec{.sphere_radius_mm = 20, .base_radius_mm = 10};
  EXPECT_NEAR(first_touch(dome, fem::SphereShape{3}, {4, 3}, level), std::sqrt(23.0 * 23.0 - 25.0) - 20.0, 1e-6);
  EXPECT_THAT(test::message_of([&] {
                first_touch(device().gel, fem::SphereShape{1}, {20, 0}, level);
              }),
              HasSubstr("isn't over the gel"));
}

}  // namespace
}  // namespace touchstone::sim
