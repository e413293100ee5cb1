// Several bodies at finite strain, and bodies that are led by torques.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "fem/finite_strain/finite_press.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::target_at;

constexpr double kThickness = 3.0;
constexpr double kRadius = 5.0;
constexpr double kAside = 3.5;  // mm: from the middle to each of two balls
const std::vector<ElasticMaterial> kSoft = {{0.33, 0.49}};

TetMesh pad(int cells = 8) {
  return fixtures::box_mesh({16, 8, kThickness}, 2 * cells, cells, cells / 2);
}

const FiniteGel& gel() {
  static const FiniteGel one(pad(), kSoft, {}, kThickness);
  return one;
}

const Compliance& linear_gel() {
  static const Compliance one = compute_compliance(pad(), kSoft[0], {}, kThickness);
  return one;
}

std::vector<PressBody> two_balls(double friction) {
  return {{SphereShape{kRadius}, friction, nullptr}, {SphereShape{kRadius}, friction, nullptr}};
}

std::array<PressTarget, 2> at_depths(double first, double second) {
  return {target_at(-kAside, 0, kRadius - first), target_at(kAside, 0, kRadius - second)};
}

PressTolerance whole_hats() {
  PressTolerance tolerance;
  tolerance.outlines = false;
  return tolerance;
}

const EggShape kEgg{5.0, 9.0, 7.0};  // round its y axis

PressTarget tilted(double angle, double z) {
  PressTarget target = target_at(0, 0, z);
  target.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return target;
}

std::string message_of(FinitePress& press, const std::vector<PressTarget>& targets) {
  try {
    press.step(targets);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Two flat balls pressed to different depths, then drawn apart.
TEST(FiniteBodies, SmallPressesOfTwoEqualTheLinearOnes) {
  const SphereShape flat{20.0};
  const std::vector<PressBody> bodies = {{flat, 0.4, nullptr}, {flat, 0.8, nullptr}};
  for (const double depth : {0.1, 0.05}) {
    Press linear(linear_gel(), bodies, whole_hats());
    FinitePress finite(gel(), bodies);
    const auto step = [&](const std::array<PressTarget, 2>& targets) {
      linear.step(targets);
      finite.step(targets);
    };
    step({target_at(-4, 0, 20 - depth), target_at(4, 0, 20 - 0.7 * depth)});
    step({target_at(-4 - 0.1 * depth, 0, 20 - depth), target_at(4, 0.1 * depth, 20 - 0.7 * depth)});
    for (int b = 0; b < 2; ++b) {
      const Eigen::Vector3d one = linear.state().bodies[b].wrench.head<3>();
      const Eigen::Vector3d other = finite.state().bodies[b].wrench.head<3>();
      RecordProperty("difference", std::to_string((one - other).norm() / one.norm()));
      EXPECT_LT((one - other).norm(), depth * one.norm()) << b;
      EXPECT_LT((one - other).head<2>().norm(), 3.0 * depth * one.head<2>().norm()) << b;
      EXPECT_GT(one.head<2>().norm(), 0.01 * one[2]) << "they are drawn";
    }
  }
}

/// Without friction each ball's force is the stored energy's derivative by its own depth, though the other holds the
/// gel between them.
TEST(FiniteBodies, ForcesOfTwoAreDerivativesOfTheStoredEnergy) {
  constexpr double kStep = 0.01;
  for (int moved = 0; moved < 2; ++moved) {
    FinitePress press(gel(), two_balls(0.0));
    const auto energy_at = [&](double more) {
      press.step(at_depths(0.9 + (moved == 0 ? more : 0.0), 0.6 + (moved == 1 ? more : 0.0)));
      return press.stored_energy();
    };
    const double below = energy_at(-kStep);
    const double above = energy_at(kStep);
    energy_at(0.0);
    const double force = press.state().bodies[moved].wrench[2];
    EXPECT_NEAR((above - below) / (2 * kStep), force, 2e-3 * force) << moved;
  }
  FinitePress alone(gel(), SphereShape{kRadius}, 0.0);
  FinitePress both(gel(), two_balls(0.0));
  const double one = alone.step(at_depths(0.9, 0.6)[0]).wrench[2];
  both.step(at_depths(0.9, 0.6));
  EXPECT_GT(std::abs(both.state().bodies[0].wrench[2] / one - 1.0), 0.01) << "they feel each other";
}

TEST(FiniteBodies, OneThatLeavesOrIsFarLeavesTheOtherAsItIsAlone) {
  FinitePress alone(gel(), SphereShape{kRadius}, 0.0);
  const double one = alone.step(at_depths(0.6, 0.0)[0]).wrench[2];
  FinitePress press(gel(), two_balls(0.0));
  press.step(at_depths(0.6, 0.5));
  const PressState& left = press.step(at_depths(0.6, -0.5));
  EXPECT_EQ(left.bodies[1].wrench.norm(), 0.0);
  EXPECT_EQ(left.bodies[1].contact_vertices, 0);
  EXPECT_NEAR(left.bodies[0].wrench[2], one, 1e-5 * one);
  std::array<PressTarget, 2> targets = at_depths(0.6, 0.5);
  press.step(targets);
  targets[1].axis[2] = AxisControl::with_force(0.0);
  EXPECT_NEAR(press.step(targets).bodies[0].wrench[2], one, 2e-2 * one) << "it just touches the undeformed gel";
  targets[1] = target_at(100, 0, 0);
  EXPECT_NEAR(press.step(targets).bodies[0].wrench[2], one, 1e-5 * one);
  targets[0] = target_at(0, 0, 100);
  const PressState& apart = press.step(targets);
  EXPECT_EQ(apart.wrench.norm(), 0.0);
  EXPECT_EQ(press.stored_energy(), 0.0);
}

TEST(FiniteBodies, EachIsLedByItsOwnForce) {
  FinitePress press(gel(), two_balls(0.3));
  std::array<PressTarget, 2> targets = at_depths(0.0, 0.0);
  targets[0].axis[2] = AxisControl::with_force(2.0);
  targets[1].axis[2] = AxisControl::with_force(0.3);
  press.step(targets);
  EXPECT_NEAR(press.state().bodies[0].wrench[2], 2.0, 1e-5);
  EXPECT_NEAR(press.state().bodies[1].wrench[2], 0.3, 1e-5);
  targets[0].axis[2] = AxisControl::with_force(0.2);
  targets[1] = at_depths(0.0, 0.5)[1];
  targets[1].axis[0] = AxisControl::with_force(0.05);
  const PressState& state = press.step(targets);
  EXPECT_NEAR(state.bodies[0].wrench[2], 0.2, 1e-5);
  EXPECT_NEAR(state.bodies[1].wrench[0], 0.05, 1e-5);
  EXPECT_LT(state.cone_violation, 1e-6);
  EXPECT_LT(state.force_residual, 1e-5);
  for (int v = 0; v < static_cast<int>(state.node_owner.size()); ++v) {
    EXPECT_EQ(state.node_owner[v] < 0, state.node_state[v] == NodeState::open);
    if (state.node_owner[v] >= 0) {
      EXPECT_EQ(state.node_owner[v], gel().rest.vertices[v].x() > 0.0) << v;
    }
  }
}

/// Balls whose contacts grow into each other: where they meet each vertex is the nearer one's, and no law is broken.
TEST(FiniteBodies, ContactsThatMeetKeepTheirLaws) {
  FinitePress press(gel(), two_balls(0.2));
  for (const double aside : {3.2, 2.6, 2.2}) {
    const std::array<PressTarget, 2> targets = {target_at(-aside, 0, kRadius - 0.8),
                                                target_at(aside, 0, kRadius - 0.8)};
    const PressState& state = press.step(targets);
    EXPECT_LT(state.largest_penetration, 1e-5);
    EXPECT_EQ(state.largest_tension, 0.0);
    EXPECT_LT(state.cone_violation, 1e-6);
    EXPECT_NEAR(state.bodies[0].wrench[2], state.bodies[1].wrench[2], 0.03 * state.bodies[0].wrench[2]);
  }
}

TEST(FiniteBodies, AnElasticOneBesideARigidOneGivesWay) {
  TetMesh mesh = fixtures::box_mesh({3, 3, 2}, 6, 6, 4);
  const auto soft = std::make_shared<Compliance>(compute_compliance(mesh, {0.5, 0.45}, {}, 2.0));
  // Its frame's z points into the gel, its outer surface is at z = 0 there; the box's middle is 1 mm behind.
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex.z() += 1.0;
  const auto raised = std::make_shared<Compliance>(compute_compliance(mesh, {0.5, 0.45}, {}, 2.0));
  std::vector<PressBody> bodies = two_balls(0.3);
  bodies[0] = {BoxShape{{3, 3, 2}}, 0.3, raised};
  std::vector<PressBody> rigid = bodies;
  rigid[0].elastic = nullptr;
  std::array<PressTarget, 2> targets = at_depths(0.0, 0.5);
  targets[0] = target_at(-kAside - 0.5, 0, 1.0 - 0.3);
  targets[0].rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
  FinitePress one(gel(), bodies);
  FinitePress other(gel(), rigid);
  one.step(targets);
  other.step(targets);
  EXPECT_LT(one.state().bodies[0].wrench[2], 0.8 * other.state().bodies[0].wrench[2]);
  EXPECT_NEAR(one.state().bodies[1].wrench[2], other.state().bodies[1].wrench[2],
              0.1 * other.state().bodies[1].wrench[2]);
}

/// The torque about the body's origin is the stored energy's derivative by its tilt, and led by that torque the body
/// comes to that tilt.
TEST(FiniteTorque, IsTheDerivativeOfTheStoredEnergyAndLeadsBackToTheTilt) {
  constexpr double kStep = 0.005;
  constexpr double kTilt = 0.12;
  const double z = 5.0 - 0.7;
  FinitePress by_pose(gel(), kEgg, 0.0);
  by_pose.step(tilted(kTilt - kStep, z));
  const double below = by_pose.stored_energy();
  by_pose.step(tilted(kTilt + kStep, z));
  const double above = by_pose.stored_energy();
  const PressState& posed = by_pose.step(tilted(kTilt, z));
  const auto torque = [](const PressState& state) -> double {
    const Eigen::Vector3d place = state.gel_from_object.translation;
    return (state.wrench.tail<3>() - place.cross(Eigen::Vector3d(state.wrench.head<3>())))[0];
  };
  EXPECT_GT(std::abs(torque(posed)), 0.1);
  EXPECT_NEAR((above - below) / (2 * kStep), -torque(posed), 5e-3 * std::abs(torque(posed)));

  FinitePress led(gel(), kEgg, 0.0);
  PressTarget target = target_at(0, 0, z);
  target.axis[2] = AxisControl::with_force(posed.wrench[2]);
  target.torque[0] = torque(posed);
  const PressState& found = led.step(target);
  EXPECT_NEAR(std::atan2(found.gel_from_object.rotation(2, 1), found.gel_from_object.rotation(1, 1)), kTilt, 1e-3);
  EXPECT_NEAR(found.gel_from_object.translation.z(), z, 1e-3);
  EXPECT_LT(found.torque_residual, 1e-4);
  EXPECT_LT(found.force_residual, 1e-5);
}

/// A punch whose origin is in its face: in linear elasticity contact acts along the undeformed normal, so that torques
/// about an origin far above differ whatever the load.
TEST(FiniteTorque, SmallOnesTurnAsTheLinearOnes) {
  const RoundedCylinder punch{3.0, 1.0, 2.0};
  for (const double friction : {0.0, 0.5}) {
    for (const double force : {0.4, 0.2}) {
      PressTarget target = target_at(0, 0, 0);
      target.axis[2] = AxisControl::with_force(force);
      target.torque[0] = 0.4 * force;
      Press linear(linear_gel(), std::vector<PressBody>{{punch, friction, nullptr}}, whole_hats());
      FinitePress finite(gel(), punch, friction);
      const Eigen::Matrix3d a = linear.step(target).gel_from_object.rotation;
      const Eigen::Matrix3d b = finite.step(target).gel_from_object.rotation;
      const double angle = Eigen::AngleAxisd(a).angle();
      const double difference = Eigen::AngleAxisd(a.transpose() * b).angle() / angle;
      RecordProperty("difference", std::to_string(difference));
      EXPECT_LT(difference, 0.2 * force) << friction << " " << force << " " << angle;  // first order in the strain
    }
  }
}

/// A rod across the pad, held by no torque about its axis's own, rolls along without any shear.
TEST(FiniteTorque, AFreeBodyRollsWithoutShear) {
  FinitePress press(gel(), SphereShape{kRadius}, 0.8);
  PressTarget target = target_at(-0.4, 0, kRadius);
  target.axis[2] = AxisControl::with_force(1.0);
  target.torque[1] = 0.0;
  press.step(target);
  for (const double x : {-0.2, 0.0, 0.2, 0.4}) {
    target.axis[0] = AxisControl::at(x);
    const PressState& state = press.step(target);
    EXPECT_LT(std::abs(state.wrench[0]), 0.05) << "friction alone would hold 0.8";
    const Eigen::Matrix3d turned = state.gel_from_object.rotation;
    EXPECT_NEAR(std::atan2(turned(0, 2), turned(0, 0)) * kRadius, x + 0.4, 0.25 * (x + 0.4));
  }
}

TEST(FiniteTorque, WhatCantBeHadIsRefusedAndChangesNothing) {
  FinitePress press(gel(), BoxShape{{5, 4, 2}}, 0.3);
  PressTarget target = target_at(0, 0, 1.0);
  target.axis[2] = AxisControl::with_force(1.0);
  press.step(target);
  const double z = press.state().gel_from_object.translation.z();
  target.torque[1] = 50.0;
  EXPECT_NE(message_of(press, {target}).find("turns over"), std::string::npos);
  target.torque[1] = 0.0;
  EXPECT_EQ(message_of(press, {target, target}), "2 targets are given for 1 bodies");
  EXPECT_NEAR(press.step(target).gel_from_object.translation.z(), z, 1e-3);
  FinitePress relaxing(gel(), SphereShape{kRadius}, 0.3, {}, PronySeries{{0.3, 1.0}});
  EXPECT_NE(message_of(relaxing, {target}).find("relaxes"), std::string::npos);
}

/// Dragged on, back and on again: each reversal ends at the friction's limit the other way.
TEST(FiniteFriction, ReversalsEndAtTheLimitOnTheOtherSide) {
  constexpr double kMu = 0.2;
  FinitePress press(gel(), kEgg, kMu);
  PressTarget target = target_at(0, 0, 5.0);
  target.axis[2] = AxisControl::with_force(1.0);
  press.step(target);
  double sign = -1.0;
  for (const double goal : {0.5, -0.5, 0.5}) {
    for (int k = 1; k <= 4; ++k) {
      const double from =
          goal == 0.5 && sign < 0.0 && press.state().gel_from_object.translation.x() >= 0.0 ? 0.0 : -goal;
      target.axis[0] = AxisControl::at(from + 0.25 * k * (goal - from));
      press.step(target);
    }
    EXPECT_NEAR(press.state().wrench[0], sign * kMu, 0.05 * kMu) << goal;
    sign = -sign;
  }
}

}  // namespace
}  // namespace touchstone::fem
