// Several bodies, elastic bodies, and control of torques.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/units.h"
#include "fem/contact/elastic_body.h"
#include "fem/contact/press.h"
#include "fem/mesh/slab.h"
#include "tests/support/half_space_gel.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::target_at;

const Compliance& flat_gel() {
  static const Compliance gel = test::half_space_gel(3.0, 0.25, {1.0, 0.49}, 10.0);
  return gel;
}

/// A small real slab, even all over.
const Compliance& slab_gel() {
  static const Compliance gel = [] {
    SlabMesh slab;
    slab.size_x = slab.size_y = 8.0;
    slab.thickness = 2.0;
    slab.fine = slab.coarse = 0.6;
    slab.fine_half_x = slab.fine_half_y = 4.0;
    slab.fine_depth = 0.6;
    return compute_compliance(mesh_slab(slab), {1.0, 0.45}, {}, slab.thickness);
  }();
  return gel;
}

TEST(SeveralBodies, ThatMissChangeNothing) {
  Press alone(flat_gel(), SphereShape{4.0}, 0.3);
  Press with(flat_gel(), std::vector<PressBody>{{SphereShape{4.0}, 0.3, nullptr}, {BoxShape{{1, 1, 1}}, 0.3, nullptr}});
  for (const PressTarget& target : {target_at(0, 0, 3.9), target_at(0.05, 0, 3.85)}) {
    const Eigen::Matrix<double, 6, 1> expected = alone.step(target).wrench;
    const PressState& state = with.step(std::array{target, target_at(1.0, 1.0, 3.0)});
    EXPECT_EQ(state.bodies[0].wrench, expected);
    EXPECT_EQ(state.bodies[1].wrench.norm(), 0.0);
  }
}

TEST(SeveralBodies, FeelEachOtherThroughTheGel) {
  // A second sphere beside the first lowers the gel there: the first, held in place, carries less.
  Press alone(flat_gel(), SphereShape{4.0}, 0.0);
  const double by_itself = alone.step(target_at(-1.2, 0, 3.9)).wrench[2];
  Press pair(flat_gel(), std::vector<PressBody>{{SphereShape{4.0}, 0.0, nullptr}, {SphereShape{4.0}, 0.0, nullptr}});
  const PressState& state = pair.step(std::array{target_at(-1.2, 0, 3.9), target_at(1.2, 0, 3.9)});
  EXPECT_LT(state.bodies[0].wrench[2], 0.97 * by_itself);
  EXPECT_NEAR(state.bodies[0].wrench[2], state.bodies[1].wrench[2], 1e-7);
  EXPECT_EQ(state.wrench, state.bodies[0].wrench);
  // One leaves: the other is as if it had never been there.
  const PressState& after = pair.step(std::array{target_at(-1.2, 0, 3.9), target_at(1.2, 0, 5.0)});
  EXPECT_NEAR(after.bodies[0].wrench[2], by_itself, 1e-9);
}

TEST(SeveralBodies, AreHeldByTheirOwnForces) {
  Press pair(flat_gel(), std::vector<PressBody>{{SphereShape{4.0}, 0.5, nullptr}, {SphereShape{3.0}, 0.2, nullptr}});
  std::array<PressTarget, 2> targets = {target_at(-1.2, 0, 4.5), target_at(1.2, 0, 3.5)};
  targets[0].axis[2] = AxisControl::with_force(0.05);
  targets[1].axis[2] = AxisControl::with_force(0.02);
  pair.step(targets);
  targets[0].axis[0] = AxisControl::with_force(0.01);
  targets[1].axis[1] = AxisControl::with_force(-0.002);
  const PressState& state = pair.step(targets);
  EXPECT_NEAR(state.bodies[0].wrench[0], 0.01, 1e-7);
  EXPECT_NEAR(state.bodies[0].wrench[2], 0.05, 1e-7);
  EXPECT_NEAR(state.bodies[1].wrench[1], -0.002, 1e-7);
  EXPECT_NEAR(state.bodies[1].wrench[2], 0.02, 1e-7);
  EXPECT_THROW(pair.step(targets[0]), Error);  // one target for two bodies
}

TEST(SeveralBodies, AFlatOneLeavesTheOtherItsFirstContact) {
  // Both are led by force from the air; the punch alone has more vertices right under it than the first block takes.
  Press pair(flat_gel(),
             std::vector<PressBody>{{RoundedCylinder{1.2, 0.2, 3.0}, 0.5, nullptr}, {SphereShape{2.0}, 0.5, nullptr}});
  std::array<PressTarget, 2> targets = {target_at(-1.5, 0, 0.5), target_at(1.5, 0, 2.5)};
  targets[0].axis[2] = AxisControl::with_force(0.1);
  targets[1].axis[2] = AxisControl::with_force(0.03);
  const PressState& state = pair.step(targets);
  EXPECT_NEAR(state.bodies[0].wrench[2], 0.1, 1e-6);
  EXPECT_NEAR(state.bodies[1].wrench[2], 0.03, 1e-6);
}

/// The slab turned over, as the compliance of a box of its size: outer face down, bonded on top.
PressBody elastic_box(double stiffness, double friction) {
  auto soft = std::make_shared<Compliance>(with_modulus(slab_gel(), stiffness * slab_gel().material.youngs_modulus));
  for (Eigen::Vector3d& vertex : soft->vertices) vertex.z() += 0.5 * soft->thickness;
  return {BoxShape{{8.0, 8.0, 2.0}}, friction, soft};
}

const Eigen::Matrix3d kUpsideDown = Eigen::Vector3d(1, -1, -1).asDiagonal();

TEST(ElasticBody, AMirrorImageOfTheGelYieldsAsMuchAsTheGel) {
  // By symmetry the interface stays plane: each half is as if pressed half as deep by a rigid plate.
  Press rigid(slab_gel(), BoxShape{{20.0, 20.0, 2.0}}, 0.0);
  const double expected = rigid.step(target_at(0, 0, 1.0 - 0.05)).wrench[2];
  Press pair(slab_gel(), std::vector<PressBody>{elastic_box(1.0, 0.0)});
  PressTarget target = target_at(0, 0, 1.0 - 0.1);
  target.rotation = kUpsideDown;
  const PressState& state = pair.step(target);
  EXPECT_NEAR(state.wrench[2], expected, 0.01 * expected);
}

TEST(ElasticBody, ItsNormalPartIsThatOfTheWhole) {
  // Contact without friction asks for the normal components only; a tilted body mixes its own into them.
  const PressBody box = elastic_box(2.0, 0.0);
  const ElasticBody body(*box.elastic);
  const ContactSurface surface(slab_gel());
  std::vector<int> vertices(surface.vertices.size());
  std::iota(vertices.begin(), vertices.end(), 0);
  std::vector<char> mine(vertices.size(), 1);
  mine[3] = mine[10] = 0;
  const std::vector<Eigen::Matrix3d> axes(
      vertices.size(), (Eigen::Matrix3d() << 0, 1, 0, 0, 0, 1, 1, 0, 0).finished());  // normal, then along the surface
  RigidTransform pose;
  pose.rotation = Eigen::AngleAxisd(0.05, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix() * kUpsideDown;
  pose.translation = {0.1, -0.2, 0.9};
  const auto m = static_cast<Eigen::Index>(vertices.size());
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(3 * m, 3 * m);
  body.add_to(whole, 1.5, surface, vertices, mine, axes, pose, {}, nullptr);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(m, m);
  body.add_normal_to(normal, 1.5, surface, vertices, mine, Eigen::Vector3d::UnitZ(), pose, {}, nullptr);
  const auto normals = Eigen::seqN(Eigen::fix<0>, m, Eigen::fix<3>);
  const Eigen::MatrixXd expected = whole(normals, normals);
  EXPECT_GT(expected.norm(), 0.0);
  EXPECT_LT((normal - expected).norm(), 1e-12 * expected.norm());
  EXPECT_EQ(normal.row(3).norm(), 0.0);
}

TEST(ElasticBody, VeryStiffIsRigid) {
  Press rigid(slab_gel(), BoxShape{{8.0, 8.0, 2.0}}, 0.4);
  Press steel(slab_gel(), std::vector<PressBody>{elastic_box(1e7, 0.4)});
  for (const double x : {0.0, 0.02}) {
    PressTarget target = target_at(x, 0, 1.0 - 0.05);
    target.rotation = kUpsideDown;
    const Eigen::Matrix<double, 6, 1> expected = rigid.step(target).wrench;
    EXPECT_LT((steel.step(target).wrench - expected).norm(), 1e-5 * expected.norm());
  }
}

TEST(ElasticBody, AndGelMayExchangeTheirRoles) {
  // A soft gel under a hard body, and the hard one under the soft one: pressed, and sheared while all sticks.
  Press usual(slab_gel(), std::vector<PressBody>{elastic_box(20.0, 50.0)});
  const Compliance hard = with_modulus(slab_gel(), 20.0 * slab_gel().material.youngs_modulus);
  Press exchanged(hard, std::vector<PressBody>{elastic_box(1.0, 50.0)});
  for (const double x : {0.0, 0.02}) {
    PressTarget target = target_at(x, 0, 1.0 - 0.05);
    target.rotation = kUpsideDown;
    const Eigen::Matrix<double, 6, 1> expected = usual.step(target).wrench;
    const Eigen::Matrix<double, 6, 1> found = exchanged.step(target).wrench;
    EXPECT_LT((found - expected).head<3>().norm(), 0.02 * expected.head<3>().norm());
  }
}

TEST(TorqueControl, ATiltedPlateAlignsItselfWithTheGel) {
  Press press(flat_gel(), BoxShape{{2.0, 2.0, 1.0}}, 0.0);
  PressTarget target = target_at(0.0, 0.0, 0.5);
  target.axis[2] = AxisControl::with_force(0.2);
  target.rotation = Eigen::AngleAxisd(0.06, Eigen::Vector3d(1, 0.5, 0).normalized()).toRotationMatrix();
  target.torque = {0.0, 0.0, std::nullopt};
  const PressState& state = press.step(target);
  EXPECT_LT(state.torque_residual, 1e-5);
  EXPECT_NEAR(state.wrench[2], 0.2, 1e-6);
  // The origin is half a millimetre over the face, right over the middle: no force has an arm there but through a tilt.
  EXPECT_LT((state.gel_from_object.rotation.col(2) - Eigen::Vector3d::UnitZ()).norm(), 2e-3);
}

TEST(TorqueControl, TiltsAPunchByTheClosedForm) {
  // A flat punch of radius a bonded or not, tilted by theta: M = 4 E a^3 theta / (3 (1 - nu^2)) [Johnson1985, sec.
  // 5.1], while all of it stays in contact.
  const Compliance gel = test::half_space_gel(3.0, 0.2, {1.0, 0.3}, 100.0);
  const double radius = 2.0;
  Press press(gel, RoundedCylinder{radius, 0.0, 3.0}, 0.0);
  PressTarget target = target_at(0.01, 0.02, -0.1);
  press.step(target);
  target.torque[0] = 0.05;
  const PressState& state = press.step(target);
  EXPECT_LT(state.torque_residual, 1e-5);
  const double angle = Eigen::AngleAxisd(state.gel_from_object.rotation).angle();
  const double expected = 0.05 * 3.0 * (1.0 - 0.09) / (4.0 * std::pow(radius, 3));
  // Ten edges a radius and a sharp rim leave 7 %; with 17 edges it is 2 %.
  EXPECT_NEAR(angle, expected, 0.08 * expected);
  // The gel turns the punch about +x because the punch has turned the gel about -x.
  EXPECT_NEAR(state.gel_from_object.rotation(2, 1), -expected, 0.08 * expected);
}

TEST(TorqueControl, TwistsAStuckPunchByTheClosedForm) {
  // M = 16 G a^3 phi / 3 [Johnson1985, sec. 3.9].
  const Compliance gel = test::half_space_gel(3.0, 0.2, {1.0, 0.3}, 100.0);
  const double radius = 2.0;
  Press press(gel, RoundedCylinder{radius, 0.0, 3.0}, std::numeric_limits<double>::infinity());
  PressTarget target = target_at(0.01, 0.02, -0.1);
  press.step(target);
  const double before = press.state().wrench[5];
  target.torque[2] = before + 0.05;
  const PressState& state = press.step(target);
  EXPECT_LT(state.torque_residual, 1e-5);
  const double expected = 3.0 * 0.05 / (16.0 * (1.0 / 2.6) * std::pow(radius, 3));
  EXPECT_NEAR(std::abs(Eigen::AngleAxisd(state.gel_from_object.rotation).angle()), expected, 0.06 * expected);
  EXPECT_LT(state.gel_from_object.rotation(1, 0), 0.0);  // against the torque on it
}

TEST(TorqueControl, HoldsAllSixComponents) {
  Press press(flat_gel(), BoxShape{{2.0, 2.0, 1.0}}, 0.6);
  PressTarget target = target_at(0.1, -0.1, 0.6);
  target.axis[2] = AxisControl::with_force(0.3);
  press.step(target);
  target.axis[0] = AxisControl::with_force(0.05);
  target.axis[1] = AxisControl::with_force(-0.03);
  target.torque = {0.02, -0.01, 0.03};
  const PressState& state = press.step(target);
  EXPECT_LT(state.force_residual, 1e-6);
  EXPECT_LT(state.torque_residual, 1e-5);
  const Eigen::Vector3d origin = state.gel_from_object.translation;
  const Eigen::Vector3d torque =
      Eigen::Vector3d(state.wrench.tail<3>()) - origin.cross(Eigen::Vector3d(state.wrench.head<3>()));
  EXPECT_LT((torque - Eigen::Vector3d(0.02, -0.01, 0.03)).norm(), 1e-5);
}

TEST(TorqueControl, RefusesWhatCannotBeHeld) {
  Press press(flat_gel(), BoxShape{{2.0, 2.0, 1.0}}, 0.3);
  PressTarget target = target_at(0, 0, 0.4);
  target.torque[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(press.step(target), Error);
  target.torque[0] = 50.0;  // more than the normal force can hold at the box's edge: it would turn over
  target.axis[2] = AxisControl::with_force(0.1);
  EXPECT_THROW(press.step(target), Error);
  EXPECT_EQ(press.state().wrench.norm(), 0.0);  // as before
}

}  // namespace
}  // namespace touchstone::fem
