// Laws of a press on a gel that relaxes.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/contact/press.h"
#include "tests/support/half_space_gel.h"

namespace touchstone::fem {
namespace {

constexpr double kRadius = 10.0;
const PronySeries kSeries = {{0.2, 0.1}, {0.3, 2.0}};

/// With two "beads" that follow two vertices of the surface.
const Compliance& gel() {
  static const Compliance made = [] {
    Compliance with_beads = test::half_space_gel(3.0, 0.25, {1.0, 0.45}, 5.0);
    const auto n = static_cast<Eigen::Index>(with_beads.vertices.size());
    const Eigen::VectorXd weight = with_beads.mass * Eigen::VectorXd::Ones(n);
    Eigen::MatrixXd beads(6, 3 * n);
    for (Eigen::Index b = 0; b < 2; ++b) {
      const Eigen::Index v = n / 2 + 2 * b;
      beads.middleRows<3>(3 * b) = with_beads.surface.view().middleRows<3>(3 * v) / weight[v];
    }
    with_beads.beads = SharedMatrix(std::move(beads));
    return with_beads;
  }();
  return made;
}

PressTarget at(double x, double y, double z, double seconds) {
  PressTarget target;
  target.axis = {AxisControl::at(x), AxisControl::at(y), AxisControl::at(z)};
  target.seconds = seconds;
  return target;
}

PressTarget sphere_at(double x, double depth, double seconds) {
  return at(x, 0.0, kRadius - depth, seconds);
}

PressTolerance tight() {
  PressTolerance tolerance;
  tolerance.lookup_mm = 1e-12;
  tolerance.traction = 1e-13;
  return tolerance;
}

Press relaxing(const ContactShape& shape, double friction) {
  return Press(gel(), shape, friction, tight(), kSeries);
}

TEST(PressRelaxation, ASphereHeldAtItsDepthRelaxesAsTheModulusAndMovesNothing) {
  for (const double friction : {0.0, 0.5}) {
    Press press = relaxing(SphereShape{kRadius}, friction);
    const PressState start = press.step(sphere_at(0, 0.2, 0.0));
    Press elastic(gel(), SphereShape{kRadius}, friction, tight());
    EXPECT_LT((start.traction - elastic.step(sphere_at(0, 0.2, 0.0)).traction).norm(), 1e-10 * start.traction.norm());
    double time = 0.0;
    for (const double step : {0.01, 0.1, 1.0, 10.0}) {
      const PressState& state = press.step(sphere_at(0, 0.2, step));
      const double share = relaxation_at(kSeries, time += step);
      EXPECT_NEAR(state.wrench[2], share * start.wrench[2], 1e-9 * start.wrench[2]) << time;
      EXPECT_LT((state.traction - share * start.traction).norm(), 1e-9 * start.traction.norm());
      EXPECT_LT((state.surface_displacement - start.surface_displacement).norm(),
                1e-9 * start.surface_displacement.norm());
      EXPECT_LT((state.bead_displacement - start.bead_displacement).norm(), 1e-9 * start.bead_displacement.norm());
      EXPECT_LT(state.largest_penetration, 1e-9);
    }
    EXPECT_GT(start.bead_displacement.norm(), 0.1);
  }
}

// With growing contact [Lee1960] the gel is at each moment where an elastic one would be under the force F E0 J(t).
TEST(PressRelaxation, ASphereHeldAtItsForceCreepsAsItsComplianceWhileContactGrows) {
  const PronySeries one = {{0.4, 0.5}};
  const double force = 0.5;
  const double creep = 1.0 / 0.6 - (1.0 / 0.6 - 1.0) * std::exp(-0.6 / 0.5);
  PressTarget target = sphere_at(0, 0, 0.0);
  Press elastic(gel(), SphereShape{kRadius}, 0.0, tight());
  target.axis[2] = AxisControl::with_force(force);
  const double first = elastic.step(target).gel_from_object.translation.z();
  target.axis[2] = AxisControl::with_force(force * creep);
  const double last = elastic.step(target).gel_from_object.translation.z();
  ASSERT_LT(last, first - 0.03);
  std::vector<double> errors;
  for (const int steps : {5, 20}) {
    Press press(gel(), SphereShape{kRadius}, 0.0, tight(), one);
    target.axis[2] = AxisControl::with_force(force);
    target.seconds = 0.0;
    EXPECT_NEAR(press.step(target).gel_from_object.translation.z(), first, 1e-9);
    target.seconds = 1.0 / steps;
    for (int k = 0; k < steps; ++k) press.step(target);
    errors.push_back(std::abs(press.state().gel_from_object.translation.z() - last));
  }
  EXPECT_LT(errors[0], 0.01 * (first - last));
  EXPECT_LT(errors[1], 0.25 * errors[0]);
}

/// A flat punch's contact doesn't change, so a ramp's traction is linear and the answer exact.
TEST(PressRelaxation, ARampOfAFlatPunchIsExactInAnyNumberOfSteps) {
  const RoundedCylinder punch{1.0, 0.0, 3.0};
  Press elastic(gel(), punch, 0.0, tight());
  const double whole = elastic.step(at(0, 0, -0.2, 0.0)).wrench[2];
  const double seconds = 0.7;
  double share = lasting_share(kSeries);
  for (const PronyTerm& term : kSeries) share -= term.share * term.time / seconds * std::expm1(-seconds / term.time);
  for (const int steps : {1, 2, 9}) {
    Press press = relaxing(punch, 0.0);
    press.step(at(0, 0, 0, 0.0));
    for (int k = 1; k <= steps; ++k) press.step(at(0, 0, -0.2 * k / steps, seconds / steps));
    EXPECT_NEAR(press.state().wrench[2], share * whole, 1e-9 * whole) << steps;
  }
  // Half of the path, and so half of the time, is through air.
  Press from_above = relaxing(punch, 0.0);
  from_above.step(at(0, 0, 0.2, 0.0));
  EXPECT_NEAR(from_above.step(at(0, 0, -0.2, 2.0 * seconds)).wrench[2], share * whole, 1e-9 * whole);
}

TEST(PressRelaxation, UnloadingLeavesADentThatRecovers) {
  Press press = relaxing(SphereShape{kRadius}, 0.0);
  press.step(sphere_at(0, 0.2, 0.0));
  const double pressed = -press.step(sphere_at(0, 0.2, 3.0)).surface_displacement.col(2).minCoeff();
  const PressState lifted = press.step(sphere_at(0, -0.5, 0.0));
  EXPECT_EQ(lifted.wrench.norm(), 0.0);
  EXPECT_EQ(lifted.contact_vertices, 0);
  double dent = -lifted.surface_displacement.col(2).minCoeff();
  EXPECT_GT(dent, 0.2 * pressed);
  EXPECT_LT(dent, 0.6 * pressed);
  EXPECT_LT(lifted.bead_displacement(0, 2), -0.2 * dent);
  for (int k = 0; k < 6; ++k) {
    const double after = -press.step(sphere_at(0, -0.5, 2.0)).surface_displacement.col(2).minCoeff();
    EXPECT_LT(after, 0.75 * dent);
    dent = after;
  }
  EXPECT_LT(dent, 0.03 * pressed);
  // As good as new.
  Press fresh = relaxing(SphereShape{kRadius}, 0.0);
  for (int k = 0; k < 20; ++k) press.step(sphere_at(0, -0.5, 10.0));
  const double force = fresh.step(sphere_at(0, 0.1, 0.0)).wrench[2];
  EXPECT_NEAR(press.step(sphere_at(0, 0.1, 0.0)).wrench[2], force, 1e-8 * force);
}

TEST(PressRelaxation, ABodyHangsFreelyInTheDentOfAnEarlierPress) {
  Press press = relaxing(SphereShape{kRadius}, 0.5);
  press.step(sphere_at(0, 0.2, 0.0));
  press.step(sphere_at(0, 0.2, 3.0));
  press.step(sphere_at(0, -0.5, 0.0));
  const PressState& hanging = press.step(sphere_at(0, 0.02, 0.0));
  EXPECT_EQ(hanging.wrench.norm(), 0.0);
  EXPECT_EQ(hanging.contact_vertices, 0);
  EXPECT_FALSE(hanging.under_resolved);
  // Deeper it touches, with less force than a fresh gel's.
  const PressState& touching = press.step(sphere_at(0, 0.2, 0.0));
  Press fresh = relaxing(SphereShape{kRadius}, 0.5);
  EXPECT_GT(touching.wrench[2], 0.0);
  EXPECT_LT(touching.wrench[2], 0.8 * fresh.step(sphere_at(0, 0.2, 0.0)).wrench[2]);
}

TEST(PressRelaxation, AStepFromContactIsAsStiffAsAnElasticOne) {
  // Whatever was before: a sudden small change meets the instantaneous modulus.
  Press press = relaxing(RoundedCylinder{1.0, 0.0, 3.0}, 0.0);
  press.step(at(0, 0, -0.1, 0.0));
  const double before = press.step(at(0, 0, -0.1, 1.0)).wrench[2];
  const double after = press.step(at(0, 0, -0.12, 0.0)).wrench[2];
  Press elastic(gel(), RoundedCylinder{1.0, 0.0, 3.0}, 0.0, tight());
  const double whole = elastic.step(at(0, 0, -0.12, 0.0)).wrench[2];
  EXPECT_NEAR(after - before, whole / 6.0, 1e-9 * whole);
}

TEST(PressRelaxation, AShearedContactHeldRelaxesAsAWhole) {
  // Normal and shear tractions, stuck and slipping ones, scale alike: no vertex changes what it does.
  Press press = relaxing(SphereShape{kRadius}, 0.4);
  press.step(sphere_at(0, 0.2, 0.0));
  const PressState start = press.step(sphere_at(0.03, 0.2, 0.0));
  int stuck = 0;
  int slipping = 0;
  for (const NodeState state : start.node_state) {
    stuck += state == NodeState::stick;
    slipping += state == NodeState::slip;
  }
  ASSERT_GT(stuck, 5);
  ASSERT_GT(slipping, 5);
  const PressState later = press.step(sphere_at(0.03, 0.2, 1.3));
  const double share = relaxation_at(kSeries, 1.3);
  EXPECT_LT((later.wrench - share * start.wrench).norm(), 1e-8 * start.wrench.norm());
  EXPECT_LT((later.traction - share * start.traction).norm(), 1e-8 * start.traction.norm());
  // Going on from there with friction stays within the cone, and back where it was, is another state: friction
  // remembers.
  const PressState forth = press.step(sphere_at(0.05, 0.2, 0.1));
  EXPECT_LT(forth.cone_violation, 1e-9);
  const PressState& back = press.step(sphere_at(0.03, 0.2, 0.0));
  EXPECT_LT(back.cone_violation, 1e-9);
  EXPECT_GT(std::abs(back.wrench[0] - later.wrench[0]), 0.02 * std::abs(later.wrench[0]));
}

TEST(PressRelaxation, TimeMattersOnlyToAGelThatRelaxes) {
  Press plain(gel(), SphereShape{kRadius}, 0.5);
  Press none(gel(), SphereShape{kRadius}, 0.5, {}, PronySeries{{0.0, 0.2}, {0.0, 3.0}});
  const auto expect_same_bytes = [](const PressState& a, const PressState& b) {
    EXPECT_EQ(a.wrench, b.wrench);
    EXPECT_EQ(a.traction, b.traction);
    EXPECT_EQ(a.surface_displacement, b.surface_displacement);
    EXPECT_EQ(a.bead_displacement, b.bead_displacement);
    EXPECT_EQ(a.node_state, b.node_state);
  };
  double time = 0.0;
  for (const auto& [x, depth] : {std::pair{0.0, -0.1}, {0.0, 0.1}, {0.05, 0.2}, {0.08, 0.15}}) {
    const PressState without = plain.step(sphere_at(x, depth, 0.0));
    expect_same_bytes(none.step(sphere_at(x, depth, time += 0.3)), without);
  }
}

TEST(PressRelaxation, BadTimesAndSeriesAreRefused) {
  Press press = relaxing(SphereShape{kRadius}, 0.0);
  press.step(sphere_at(0, 0.1, 0.0));
  const double before = press.state().wrench[2];
  for (const double seconds :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(press.step(sphere_at(0, 0.1, seconds)), Error);
    EXPECT_EQ(press.state().wrench[2], before);
  }
  EXPECT_THROW(Press(gel(), SphereShape{kRadius}, 0.0, {}, PronySeries{{1.0, 1.0}}), Error);
}

}  // namespace
}  // namespace touchstone::fem
