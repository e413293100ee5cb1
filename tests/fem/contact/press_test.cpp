#include "fem/contact/press.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <string>

#include "closed_forms/contact_closed_forms.h"
#include "core/error.h"
#include "core/units.h"
#include "tests/core/test_solids.h"
#include "tests/support/half_space_gel.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::press_refusal;
using test::target_at;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRadius = 10.0;

const Compliance& gel() {
  static const Compliance made = test::half_space_gel(3.0, 0.25, {1.0, 0.45}, 5.0);
  return made;
}

/// A sphere's lowest point at (x, y), `depth` under the undeformed surface.
PressTarget sphere_at(double x, double y, double depth) {
  return target_at(x, y, kRadius - depth);
}

PressTolerance tight() {
  PressTolerance tolerance;
  tolerance.lookup_mm = 1e-12;
  tolerance.traction = 1e-12;
  return tolerance;
}

void expect_equal_states(const PressState& a, const PressState& b, double tolerance) {
  EXPECT_LT((a.wrench - b.wrench).norm(), tolerance * a.wrench.norm());
  EXPECT_LT((a.traction - b.traction).norm(), tolerance * a.traction.norm());
  EXPECT_LT((a.surface_displacement - b.surface_displacement).norm(), tolerance * a.surface_displacement.norm());
}

TEST(Press, BeforeTheFirstStepNothingTouches) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  EXPECT_EQ(press.state().wrench.norm(), 0.0);
  EXPECT_EQ(press.state().contact_vertices, 0);
  EXPECT_EQ(press.state().node_state.size(), gel().vertices.size());
}

TEST(Press, AMissGivesExactlyZero) {
  for (const double friction : {0.0, 0.5}) {
    Press press(gel(), SphereShape{kRadius}, friction);
    for (const auto& target : {sphere_at(0, 0, -0.001), sphere_at(100, 0, 1.0), sphere_at(0, 0, 0.0)}) {
      const PressState& state = press.step(target);
      EXPECT_EQ(state.wrench.cwiseAbs().maxCoeff(), 0.0);
      EXPECT_EQ(state.traction.cwiseAbs().maxCoeff(), 0.0);
      EXPECT_EQ(state.surface_displacement.cwiseAbs().maxCoeff(), 0.0);
    }
  }
}

TEST(Press, ASphereOnAHalfSpaceFollowsHertz) {
  Press press(gel(), SphereShape{kRadius}, 0.0);
  double before = 0.0;
  for (const double depth : {0.1, 0.2, 0.3}) {
    const PressState& state = press.step(sphere_at(0, 0, depth));
    const double hertz = closed_forms::hertz_force(1.0, 0.45, kRadius, depth);
    EXPECT_NEAR(state.wrench[2], hertz, 0.03 * hertz) << depth;  // the support gel's own error; press_physics_test: 2 %
    EXPECT_GT(state.wrench[2], before);
    before = state.wrench[2];
  }
}

TEST(Press, TheContactLawsHoldAtTheEnd) {
  for (const double friction : {0.0, 0.4, 1.0}) {
    Press press(gel(), SphereShape{kRadius}, friction);
    press.step(sphere_at(0, 0, 0.15));
    const PressState& state = press.step(sphere_at(0.05, 0.02, 0.2));
    EXPECT_LT(state.largest_penetration, 2e-7);
    EXPECT_LT(state.largest_tension, 1e-12);
    EXPECT_LT(state.cone_violation, 1e-9);
    for (int v = 0; v < static_cast<int>(gel().vertices.size()); ++v) {
      if (state.node_state[v] == NodeState::open) {
        EXPECT_EQ(state.traction.row(v).norm(), 0.0);
      }
    }
  }
}

TEST(Press, NodalForcesSumToTheWrench) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  press.step(sphere_at(0.1, 0, 0.1));
  const PressState& state = press.step(sphere_at(0.15, 0.05, 0.2));
  // int t dA and int x cross t dA by the mass matrix, on the displaced surface.
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  const auto n = static_cast<Eigen::Index>(gel().vertices.size());
  const Eigen::MatrixX3d lumped = gel().mass * state.traction;
  for (Eigen::Index v = 0; v < n; ++v) {
    const Eigen::Vector3d f = lumped.row(v);
    force -= f;
    const Eigen::Vector3d x =
        gel().vertices[static_cast<std::size_t>(v)] + state.surface_displacement.row(v).transpose();
    torque -= x.cross(f);
  }
  EXPECT_LT((force - state.wrench.head<3>()).norm(), 1e-12);
  EXPECT_LT((torque - state.wrench.tail<3>()).norm(), 1e-12);
}

TEST(Press, TheReportedDisplacementIsTheTractionsResponse) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  const PressState& state = press.step(sphere_at(0, 0, 0.2));
  const auto n = static_cast<Eigen::Index>(gel().vertices.size());
  Eigen::VectorXd traction(3 * n);
  for (Eigen::Index v = 0; v < n; ++v) traction.segment<3>(3 * v) = state.traction.row(v);
  const Eigen::VectorXd weighted = gel().surface.view() * traction;
  const Eigen::MatrixX3d back = gel().mass * state.surface_displacement;
  for (Eigen::Index v = 0; v < n; ++v) {
    EXPECT_LT((back.row(v).transpose() - weighted.segment<3>(3 * v)).norm(), 1e-13);
  }
}

TEST(Press, ASymmetricPressGivesNoShear) {
  for (const double friction : {0.0, 0.3, 2.0}) {
    Press press(gel(), SphereShape{kRadius}, friction);
    const PressState& state = press.step(sphere_at(0, 0, 0.2));
    EXPECT_NEAR(state.wrench[0], 0.0, 1e-9 * state.wrench[2]);
    EXPECT_NEAR(state.wrench[1], 0.0, 1e-9 * state.wrench[2]);
    EXPECT_NEAR(state.wrench.tail<3>().norm(), 0.0, 1e-9 * state.wrench[2]);
  }
}

TEST(Press, WithoutFrictionThePathDoesNotMatter) {
  Press one(gel(), SphereShape{kRadius}, 0.0, tight());
  Press many(gel(), SphereShape{kRadius}, 0.0, tight());
  many.step(sphere_at(-0.4, 0.3, 0.1));
  many.step(sphere_at(0.2, 0.1, 0.35));
  many.step(sphere_at(0.1, -0.05, 0.25));
  many.step(sphere_at(0.1, 0.05, 0.2));
  one.step(sphere_at(0.1, 0.05, 0.2));
  expect_equal_states(one.state(), many.state(), 1e-8);
}

TEST(Press, WithoutFrictionUnloadingLeavesNothing) {
  Press press(gel(), SphereShape{kRadius}, 0.0);
  press.step(sphere_at(0, 0, 0.3));
  press.step(sphere_at(0.5, 0, 0.1));
  const PressState& state = press.step(sphere_at(0.5, 0, -1e-6));
  EXPECT_EQ(state.wrench.norm(), 0.0);
  EXPECT_EQ(state.traction.norm(), 0.0);
}

TEST(Press, WithFrictionUnloadingToAirLeavesNothing) {
  Press press(gel(), SphereShape{kRadius}, 0.6);
  press.step(sphere_at(0, 0, 0.3));
  press.step(sphere_at(0.1, 0, 0.3));
  press.step(sphere_at(0.1, 0, -0.1));
  EXPECT_EQ(press.state().wrench.norm(), 0.0);
  // And the next touch knows nothing of the first.
  press.step(sphere_at(0, 0, -0.1));
  press.step(sphere_at(0, 0, 0.2));
  EXPECT_NEAR(press.state().wrench[0], 0.0, 1e-9);
}

TEST(Press, ForceControlMeetsTheForce) {
  for (const double friction : {0.0, 0.5}) {
    Press press(gel(), SphereShape{kRadius}, friction);
    PressTarget target = target_at(0, 0, 0);
    for (const double force : {0.2, 0.5, 0.1, 0.6}) {
      target.axis[2] = AxisControl::with_force(force);
      const PressState& state = press.step(target);
      EXPECT_NEAR(state.wrench[2], force, 1e-9);
      EXPECT_LT(state.force_residual, 1e-9);
    }
  }
}

TEST(Press, ForceAndPoseControlAgree) {
  Press by_pose(gel(), SphereShape{kRadius}, 0.0, tight());
  const double force = by_pose.step(sphere_at(0.1, 0, 0.2)).wrench[2];
  Press by_force(gel(), SphereShape{kRadius}, 0.0, tight());
  PressTarget target = target_at(0.1, 0, 0);
  target.axis[2] = AxisControl::with_force(force);
  by_force.step(target);
  EXPECT_NEAR(by_force.state().gel_from_object.translation.z(), kRadius - 0.2, 1e-9);
}

// From the first touch to the whole force at once: what the first look at the gel gives, a few vertices that carry all
// of it, must not lead to smaller parts of the step.
TEST(Press, AFirstPressByForceWithFrictionTakesOnePart) {
  for (const double force : {0.2, 1.0, 3.0}) {
    PressTarget target = sphere_at(0.03, 0.02, 0.0);
    target.axis[2] = AxisControl::with_force(force);
    Press press(gel(), SphereShape{kRadius}, 0.5, tight());
    const PressState& state = press.step(target);
    EXPECT_EQ(state.parts, 1) << force;
    EXPECT_NEAR(state.wrench[2], force, 1e-6);
  }
}

// Beside a press led to 1 N in 64 steps: the depth is nearly the same however it is reached, the displacement along the
// surface comes nearer with each part.
TEST(Press, PartsOfAFirstTouchBringTheDisplacementAlongTheSurface) {
  PressTarget target = sphere_at(0.03, 0.02, 0.0);
  Press slowly(gel(), SphereShape{kRadius}, 0.5, tight());
  for (int k = 1; k <= 64; ++k) {
    target.axis[2] = AxisControl::with_force(k / 64.0);
    slowly.step(target);
  }
  const Eigen::MatrixX2d wanted = slowly.state().surface_displacement.leftCols<2>();
  const double wanted_depth = kRadius - slowly.state().gel_from_object.translation.z();
  double before = 0.5;
  for (const int parts : {1, 2, 4}) {
    PressTolerance tolerance = tight();
    tolerance.touch_parts = parts;
    Press press(gel(), SphereShape{kRadius}, 0.5, tolerance);
    const PressState& state = press.step(target);
    EXPECT_EQ(state.parts, parts);
    EXPECT_NEAR(kRadius - state.gel_from_object.translation.z(), wanted_depth, 1e-3 * wanted_depth);
    const double off = (state.surface_displacement.leftCols<2>() - wanted).norm() / wanted.norm();
    EXPECT_LT(off, parts == 4 ? 0.2 : before);
    before = off;
  }
  PressTolerance tolerance = tight();
  tolerance.touch_parts = 4;
  Press by_depth(gel(), SphereShape{kRadius}, 0.5, tolerance);
  EXPECT_EQ(by_depth.step(sphere_at(0.03, 0.02, wanted_depth)).parts, 1);
}

TEST(Press, NoNormalForceMeansJustTouching) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  PressTarget target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(0.3);
  press.step(target);
  target.axis[2] = AxisControl::with_force(0.0);
  const PressState& state = press.step(target);
  EXPECT_EQ(state.wrench.norm(), 0.0);
  EXPECT_NEAR(state.gel_from_object.translation.z(), kRadius, 1e-2);
}

TEST(Press, ShearForceControlMeetsBothForces) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  PressTarget target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(0.4);
  press.step(target);
  double moved = 0.0;
  for (const double shear : {0.05, 0.1, 0.15}) {
    target.axis[0] = AxisControl::with_force(-shear);  // the gel pushes the object back along -x
    const PressState& state = press.step(target);
    EXPECT_NEAR(state.wrench[2], 0.4, 1e-9);
    EXPECT_NEAR(state.wrench[0], -shear, 1e-9);
    EXPECT_NEAR(state.wrench[1], 0.0, 1e-8);
    EXPECT_GT(state.gel_from_object.translation.x(), moved);
    moved = state.gel_from_object.translation.x();
  }
}

TEST(Press, FollowsCattaneoAndMindlin) {
  // nu = 0.5 of the support gel would make it exact; at 0.45 normal and tangential parts hardly couple.
  const double friction = 0.3;
  const double force = 0.6;
  Press press(gel(), SphereShape{kRadius}, friction);
  PressTarget target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(force);
  const PressState first = press.step(target);
  const double depth = kRadius - first.gel_from_object.translation.z();
  const double a = closed_forms::hertz_contact_radius(kRadius, depth);
  const double shear = 0.6 * friction * force;
  target.axis[0] = AxisControl::with_force(-shear);
  const PressState& state = press.step(target);
  const double wanted = closed_forms::mindlin_displacement(1.0, 0.45, a, shear, friction, force);
  EXPECT_NEAR(state.gel_from_object.translation.x(), wanted, 0.06 * wanted);
  double stuck = 0.0;
  double all = 0.0;
  const Eigen::VectorXd weight = gel().mass * Eigen::VectorXd::Ones(static_cast<Eigen::Index>(gel().vertices.size()));
  for (std::size_t v = 0; v < state.node_state.size(); ++v) {
    const double w = weight[static_cast<Eigen::Index>(v)];
    if (state.node_state[v] == NodeState::stick) stuck += w;
    if (state.node_state[v] != NodeState::open) all += w;
  }
  EXPECT_NEAR(std::sqrt(stuck / all), closed_forms::mindlin_stick_ratio(shear, friction, force), 0.08);
}

TEST(Press, GrossSlipIsRefusedAtTheLimitAndBeyond) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  PressTarget target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(0.4);
  press.step(target);
  const PressState before = press.state();
  for (const double shear : {0.2, 0.21, 5.0}) {
    target.axis[0] = AxisControl::with_force(shear);
    EXPECT_NE(press_refusal(press, target).find("gross slip"), std::string::npos);
    expect_equal_states(before, press.state(), 1e-15);  // as before the step
  }
  target.axis[0] = AxisControl::with_force(0.19);
  EXPECT_EQ(press_refusal(press, target), "");
}

TEST(Press, GrossSlipIsRefusedAtHeldDepth) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  press.step(sphere_at(0, 0, 0.2));
  PressTarget target = sphere_at(0, 0, 0.2);
  target.axis[0] = AxisControl::with_force(5.0);
  EXPECT_NE(press_refusal(press, target).find("gross slip"), std::string::npos);
  Press smooth(gel(), SphereShape{kRadius}, 0.0);
  EXPECT_NE(press_refusal(smooth, target).find("gross slip"), std::string::npos);
  target.axis[2] = AxisControl::at(kRadius + 1.0);
  EXPECT_NE(press_refusal(press, target).find("gross slip"), std::string::npos);
}

TEST(Press, ALongSlideCarriesMuTimesTheNormalForce) {
  Press press(gel(), SphereShape{kRadius}, 0.4);
  press.step(sphere_at(-0.5, 0, 0.2));
  for (int k = 1; k <= 10; ++k) press.step(sphere_at(-0.5 + 0.1 * k, 0, 0.2));
  const PressState& state = press.state();
  EXPECT_NEAR(state.wrench[0], -0.4 * state.wrench[2], 1e-4 * state.wrench[2]);  // directions fan out a little
  EXPECT_GE(state.wrench[0], -0.4 * state.wrench[2]);
  for (const NodeState s : state.node_state) EXPECT_NE(s, NodeState::stick);
}

TEST(Press, WhatSticksIsCarriedAlong) {
  // Under a firm stick the gel goes with the object: the middle vertex's displacement is the object's.
  Press press(gel(), SphereShape{kRadius}, kInfinity);
  press.step(sphere_at(0, 0, 0.2));
  press.step(sphere_at(0.05, 0.03, 0.2));
  const PressState& state = press.state();
  int middle = 0;
  for (std::size_t v = 0; v < gel().vertices.size(); ++v) {
    if (gel().vertices[v].norm() < gel().vertices[static_cast<std::size_t>(middle)].norm())
      middle = static_cast<int>(v);
  }
  EXPECT_NEAR(state.surface_displacement(middle, 0), 0.05, 0.001);
  EXPECT_NEAR(state.surface_displacement(middle, 1), 0.03, 0.001);
}

TEST(Press, AStuckTwistGivesATorqueAndNoForce) {
  Press press(gel(), SphereShape{kRadius}, 5.0);
  press.step(sphere_at(0, 0, 0.3));
  PressTarget target = sphere_at(0, 0, 0.3);
  target.rotation = Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const PressState& state = press.step(target);
  EXPECT_LT(state.wrench[5], -1e-4);  // the gel turns the object back
  EXPECT_NEAR(state.wrench[0], 0.0, 1e-6 * state.wrench[2]);
  EXPECT_NEAR(state.wrench[1], 0.0, 1e-6 * state.wrench[2]);
}

TEST(Press, NoFrictionIsBitwiseTheFrictionlessAnswer) {
  // Friction zero with a path that would matter, against the same depth straight down.
  Press press(gel(), SphereShape{kRadius}, 0.0);
  Press again(gel(), SphereShape{kRadius}, -0.0);
  const PressState& a = press.step(sphere_at(0.1, 0, 0.2));
  const PressState& b = again.step(sphere_at(0.1, 0, 0.2));
  EXPECT_EQ((a.traction - b.traction).cwiseAbs().maxCoeff(), 0.0);
  for (Eigen::Index v = 0; v < a.traction.rows(); ++v) {
    EXPECT_EQ(a.traction(v, 0), 0.0);
    EXPECT_EQ(a.traction(v, 1), 0.0);
  }
}

TEST(Press, InfiniteFrictionIsTheLimitOfLargeFriction) {
  Press bonded(gel(), SphereShape{kRadius}, kInfinity);
  Press rough(gel(), SphereShape{kRadius}, 1e3);
  for (Press* press : {&bonded, &rough}) {
    press->step(sphere_at(0, 0, 0.2));
    press->step(sphere_at(0.02, 0, 0.2));
  }
  EXPECT_NEAR(bonded.state().wrench[0], rough.state().wrench[0], 1e-2 * std::abs(rough.state().wrench[0]));
  EXPECT_NEAR(bonded.state().wrench[2], rough.state().wrench[2], 1e-3 * rough.state().wrench[2]);
}

TEST(Press, StickSlipReversalConvergesUnderStepHalving) {
  const auto force_after = [](int steps) {
    Press press(gel(), SphereShape{kRadius}, 0.3);
    press.step(sphere_at(0, 0, 0.2));
    const auto walk = [&](double from, double to) {
      for (int k = 1; k <= steps; ++k) press.step(sphere_at(from + (to - from) * k / steps, 0, 0.2));
    };
    walk(0.0, 0.06);
    walk(0.06, -0.02);
    return press.state().wrench[0];
  };
  const double coarse = force_after(2);
  const double middle = force_after(4);
  const double fine = force_after(8);
  EXPECT_LT(std::abs(fine - middle), 0.7 * std::abs(middle - coarse) + 1e-6);
  EXPECT_LT(std::abs(fine - middle), 0.02 * std::abs(fine));
}

TEST(Press, SmallPartsComeFromTheTolerance) {
  PressTolerance tolerance;
  tolerance.largest_motion = 0.02;
  Press cut(gel(), SphereShape{kRadius}, 0.3, tolerance);
  cut.step(sphere_at(0, 0, 0.2));
  EXPECT_EQ(cut.state().parts, 10);
  cut.step(sphere_at(0.05, 0, 0.2));
  EXPECT_EQ(cut.state().parts, 3);
}

TEST(Press, TheObjectMovedByANanometreMovesTheAnswerAsLittle) {
  for (const double friction : {0.0, 0.4}) {
    for (int k = 0; k < 5; ++k) {
      const double x = 0.037 * k;
      Press here(gel(), SphereShape{kRadius}, friction, tight());
      Press there(gel(), SphereShape{kRadius}, friction, tight());
      here.step(sphere_at(x, 0, 0.2));
      there.step(sphere_at(x + 1e-9, 0, 0.2 + 1e-9));
      EXPECT_LT((here.state().wrench - there.state().wrench).norm(), 1e-7);
      EXPECT_LT((here.state().surface_displacement - there.state().surface_displacement).norm(), 1e-6);
    }
  }
}

TEST(Press, ScalesWithUnits) {
  // The same problem in other units: lengths by 1e-3, stresses by 1e6 (metres and pascals).
  const double length = 1e-3;
  const double stress = 1e6;
  Compliance scaled = gel();
  for (auto& v : scaled.vertices) v *= length;
  scaled.thickness *= length;
  scaled.mass *= length * length;
  scaled.surface = Eigen::MatrixXd(scaled.surface.view() * (length * length * length / stress));
  PressTolerance tolerance = tight();
  Press plain(gel(), SphereShape{kRadius}, 0.4, tolerance);
  tolerance.lookup_mm *= length;
  Press other(scaled, SphereShape{kRadius * length}, 0.4, tolerance);
  for (const auto& [x, depth] : {std::pair{0.0, 0.1}, {0.02, 0.2}, {0.1, 0.15}}) {
    plain.step(sphere_at(x, 0, depth));
    other.step(target_at(x * length, 0, (kRadius - depth) * length));
    const double force = stress * length * length;
    EXPECT_LT((other.state().wrench.head<3>() / force - plain.state().wrench.head<3>()).norm(), 1e-9);
    EXPECT_LT((other.state().traction / stress - plain.state().traction).norm(), 1e-7);
  }
}

TEST(Press, RefusesWhatIsDeeperThanTheGel) {
  for (const double friction : {0.0, 0.5}) {
    Press press(gel(), SphereShape{kRadius}, friction);
    EXPECT_NE(press_refusal(press, sphere_at(0, 0, 5.1)).find("reaches"), std::string::npos);
    PressTarget target = target_at(0, 0, 0);
    target.axis[2] = AxisControl::with_force(1e4);
    EXPECT_NE(press_refusal(press, target), "");
  }
}

TEST(Press, RefusesBadTargets) {
  Press press(gel(), SphereShape{kRadius}, 0.5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(press_refusal(press, target_at(nan, 0, 0)).find("finite"), std::string::npos);
  EXPECT_NE(press_refusal(press, target_at(0, 0, kInfinity)).find("finite"), std::string::npos);
  PressTarget target = sphere_at(0, 0, 0.1);
  target.rotation(0, 1) = nan;
  EXPECT_NE(press_refusal(press, target).find("rotation"), std::string::npos);
  target.rotation = 2.0 * Eigen::Matrix3d::Identity();
  EXPECT_NE(press_refusal(press, target).find("rotation"), std::string::npos);
  target.rotation = Eigen::Vector3d(1, 1, -1).asDiagonal();
  EXPECT_NE(press_refusal(press, target).find("rotation"), std::string::npos);
  target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(-0.1);
  EXPECT_NE(press_refusal(press, target).find("can't pull"), std::string::npos);
  target = target_at(100, 0, 0);
  target.axis[2] = AxisControl::with_force(0.1);
  EXPECT_NE(press_refusal(press, target).find("isn't over the gel"), std::string::npos);
  EXPECT_THROW(Press(gel(), SphereShape{1.0}, -0.1), Error);
  EXPECT_THROW(Press(gel(), SphereShape{1.0}, nan), Error);
}

TEST(Press, AContactOverTheEdgeOfThePadIsFinite) {
  Press press(gel(), BoxShape{{4.0, 4.0, 2.0}}, 0.3);
  const PressState& state = press.step(target_at(3.0, 0, 1.0 - 0.1));
  EXPECT_TRUE(state.wrench.allFinite());
  EXPECT_GT(state.wrench[2], 0.0);
  EXPECT_GT(-state.wrench[4], 0.0);  // its middle stands at x > 0
}

TEST(Press, AContactSmallerThanATriangleSaysThatItIsUnderResolved) {
  Press press(gel(), SphereShape{0.2}, 0.3);
  const PressState& state = press.step(target_at(0.03, 0.02, 0.2 - 0.02));
  EXPECT_GE(state.wrench[2], 0.0);
  EXPECT_TRUE(state.under_resolved);
  PressTarget pushed = target_at(0.03, 0.02, 0);
  pushed.axis[2] = AxisControl::with_force(0.02);
  EXPECT_NEAR(press.step(pushed).wrench[2], 0.02, 1e-9);
  EXPECT_TRUE(press.state().under_resolved);
  EXPECT_LT(press.state().largest_tension, 1e-12);
  Press large(gel(), SphereShape{kRadius}, 0.3);
  EXPECT_FALSE(large.step(sphere_at(0, 0, 0.2)).under_resolved);
}

TEST(Press, TheForceOfASharpPunchIsProportionalToItsDepth) {
  Press press(gel(), RoundedCylinder{1.2, 0.0, 3.0}, 0.0);
  const double shallow = press.step(target_at(0, 0, -0.05)).wrench[2];
  const double deep = press.step(target_at(0, 0, -0.2)).wrench[2];
  EXPECT_NEAR(deep, 4.0 * shallow, 1e-6 * deep);
  const double wanted = closed_forms::flat_punch_force(1.0, 0.45, 1.2, 0.2);
  EXPECT_NEAR(deep, wanted, 0.05 * wanted);
}

TEST(Press, AFinelyFacetedSphereIsNearlyASphere) {
  const MeshShape faceted(touchstone::sphere(240, 480, 4.0));
  for (const double friction : {0.0, 0.4}) {
    Press smooth(gel(), SphereShape{4.0}, friction);
    Press mesh(gel(), faceted, friction);
    for (const auto& target : {target_at(0, 0, 4.0 - 0.2), target_at(0.05, 0, 4.0 - 0.25)}) {
      const Eigen::Matrix<double, 6, 1> wanted = smooth.step(target).wrench;
      EXPECT_LT((mesh.step(target).wrench - wanted).norm(), 0.01 * wanted.norm());
    }
  }
}

TEST(Press, ABoxAndItsMeshPressAlike) {
  TriangleMesh mesh = touchstone::cube(2);
  for (auto& v : mesh.vertices) v = (v - Eigen::Vector3d::Constant(0.5)).cwiseProduct(Eigen::Vector3d(2.0, 1.5, 1.0));
  Press box(gel(), BoxShape{{2.0, 1.5, 1.0}}, 0.3);
  Press faceted(gel(), MeshShape(mesh), 0.3);
  PressTarget target = target_at(0.03, 0.02, 0.5 - 0.1);
  target.rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 0.4, 0.2).normalized()).toRotationMatrix();
  const Eigen::Matrix<double, 6, 1> wanted = box.step(target).wrench;
  EXPECT_GT(wanted[2], 0.0);
  EXPECT_LT((faceted.step(target).wrench - wanted).norm(), 1e-6 * wanted.norm());
}

TEST(Press, ATiltedPunchLeansOnItsLowSide) {
  for (const double friction : {0.0, 0.5}) {
    Press press(gel(), RoundedCylinder{1.5, 0.3, 2.0}, friction);
    PressTarget target = target_at(0, 0, 0);
    target.axis[2] = AxisControl::with_force(0.3);
    // A turn about y by a positive angle lowers the side at x > 0.
    target.rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const PressState& state = press.step(target);
    EXPECT_NEAR(state.wrench[2], 0.3, 1e-9);
    EXPECT_LT(state.wrench[4], -0.02);  // push up at x > 0: negative torque about y
    EXPECT_NEAR(state.wrench[3], 0.0, 1e-3);
  }
}

TEST(Press, RockingWithFrictionKeepsTheLaws) {
  Press press(gel(), RoundedCylinder{1.5, 0.3, 2.0}, 0.5);
  PressTarget target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(0.3);
  for (const double angle : {0.0, 0.05, 0.1, -0.1, 0.0}) {
    target.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const PressState& state = press.step(target);
    EXPECT_NEAR(state.wrench[2], 0.3, 1e-9);
    EXPECT_LT(state.largest_penetration, 1e-5);
    EXPECT_LT(state.cone_violation, 1e-8);
  }
}

}  // namespace
}  // namespace touchstone::fem
