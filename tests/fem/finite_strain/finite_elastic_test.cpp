// An elastic object pressed on a gel at finite strain.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>

#include "core/error.h"
#include "fem/contact/press.h"
#include "fem/finite_strain/finite_press.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::target_at;

constexpr double kThickness = 3.0;
constexpr double kRadius = 5.0;
const ElasticMaterial kSoft = {0.33, 0.49};
const Eigen::Matrix3d kUpsideDown = Eigen::Vector3d(1, -1, -1).asDiagonal();

TetMesh pad(int cells = 8) {
  return fixtures::box_mesh({8, 8, kThickness}, cells, cells, cells / 2);
}

const FiniteGel& gel() {
  static const FiniteGel made(pad(), std::vector{kSoft}, {}, kThickness);
  return made;
}

/// A box wider than the pad, bonded at its far side, its outer face at +1 mm of its own frame.
PressBody box(double modulus_MPa, double friction) {
  TetMesh mesh = fixtures::box_mesh({10, 10, kThickness}, 8, 8, 4);
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex.z() += 1.0;
  auto soft =
      std::make_shared<Compliance>(compute_compliance(mesh, {modulus_MPa, kSoft.poisson_ratio}, {}, kThickness));
  return {BoxShape{{10, 10, 2}}, friction, soft};
}

/// The cap of a ball about its frame's origin, 6 mm wide, held by a plane 1 mm above that.
PressBody cap(double modulus_MPa, double friction, int cells = 8) {
  TetMesh mesh = fixtures::box_mesh({6, 6, 2}, cells, cells, cells / 2);
  for (Eigen::Vector3d& vertex : mesh.vertices) {
    const double top = std::sqrt(kRadius * kRadius - vertex.head<2>().squaredNorm());
    vertex.z() = top + 0.5 * vertex.z() * (top - 1.0);
  }
  auto soft = std::make_shared<Compliance>(compute_compliance(mesh, {modulus_MPa, 0.45}, {}, kRadius - 1.0));
  return {SphereShape{kRadius}, friction, soft};
}

PressTarget upside_down(double x, double y, double z) {
  PressTarget target = target_at(x, y, z);
  target.rotation = kUpsideDown;
  return target;
}

TEST(FiniteElasticObject, SmallPressesEqualTheLinearOnes) {
  const Compliance linear = compute_compliance(pad(), kSoft, {}, kThickness);
  for (const double friction : {0.0, 0.5}) {
    double before = 0.0;
    for (const double depth : {0.08, 0.04, 0.02}) {
      const PressBody body = box(0.5, friction);
      Press press(linear, std::vector{body});
      FinitePress finite(gel(), body);
      press.step(upside_down(0, 0, 1.0 - depth));
      finite.step(upside_down(0, 0, 1.0 - depth));
      const PressTarget dragged = upside_down(0.2 * depth, 0.1 * depth, 1.0 - depth);
      const PressState& a = press.step(dragged);
      const PressState& b = finite.step(dragged);
      const double difference = (b.wrench.head<3>() - a.wrench.head<3>()).norm() / a.wrench.head<3>().norm();
      if (before > 0.0) {
        EXPECT_NEAR(before / difference, 2.0, 0.4) << friction;
      }
      EXPECT_LT(difference, 2.0 * depth);
      before = difference;
    }
  }
}

/// With the force along the rigid cap's face it is 1.6 and 5.7 % off; on finer meshes of both up to 0.7 % are left.
TEST(FiniteElasticObject, FrictionlessForceIsTheDerivativeOfTheStoredEnergy) {
  constexpr double kStep = 0.01;
  for (const double depth : {0.5, 1.0}) {
    FinitePress press(gel(), cap(0.6, 0.0));
    press.step(upside_down(0, 0, kRadius - depth + kStep));
    const double below = press.stored_energy();
    const double force = press.step(upside_down(0, 0, kRadius - depth)).wrench[2];
    press.step(upside_down(0, 0, kRadius - depth - kStep));
    const double slope = (press.stored_energy() - below) / (2 * kStep);
    EXPECT_NEAR(slope, force, 6e-3 * force) << depth;
  }
}

TEST(FiniteElasticObject, AStiffOneIsAsARigidOne) {
  for (const double friction : {0.0, 0.4}) {
    FinitePress rigid(gel(), SphereShape{kRadius}, friction);
    FinitePress stiff(gel(), cap(3e3, friction));
    for (const double x : {0.0, 0.1, 0.25}) {
      const PressState& a = rigid.step(target_at(x, 0, kRadius - 0.6));
      const PressState& b = stiff.step(upside_down(x, 0, kRadius - 0.6));
      EXPECT_LT((a.wrench.head<3>() - b.wrench.head<3>()).norm(), 2e-3 * a.wrench.norm());
    }
  }
}

TEST(FiniteElasticObject, IsHeldByForcesAndSlidesAtTheFrictionsLimit) {
  FinitePress press(gel(), cap(0.6, 0.2));
  PressTarget target = upside_down(0, 0, kRadius);
  target.axis[2] = AxisControl::with_force(1.0);
  const PressState& held = press.step(target);
  EXPECT_NEAR(held.wrench[2], 1.0, 1e-5);
  // The rigid one meets the same force higher up.
  FinitePress rigid(gel(), SphereShape{kRadius}, 0.2);
  PressTarget same = target_at(0, 0, kRadius);
  same.axis[2] = target.axis[2];
  EXPECT_GT(rigid.step(same).gel_from_object.translation.z(), held.gel_from_object.translation.z() + 0.05);
  for (const double x : {0.2, 0.4, 0.8, 1.0}) {
    target.axis[0] = AxisControl::at(x);
    const PressState& state = press.step(target);
    EXPECT_LT(state.cone_violation, 1e-6);
    EXPECT_LT(state.largest_penetration, 1e-5);
    EXPECT_EQ(state.largest_tension, 0.0);
  }
  EXPECT_NEAR(-press.state().wrench[0], 0.2, 0.04);
}

TEST(FiniteElasticObject, IsRefusedOnAGelThatRelaxes) {
  EXPECT_THROW(FinitePress(gel(), box(1.0, 0.0), {}, PronySeries{{0.3, 1.0}}), Error);
}

}  // namespace
}  // namespace touchstone::fem
