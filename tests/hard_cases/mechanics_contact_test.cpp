// The hard cases that concern contact, on the gel of the vhs sensor: 6 to 11, 14, 19 to 26. What a good program does
// with each stands in script/hard_cases_page.py.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/triangle_mesh.h"
#include "core/units.h"
#include "fem/contact/contact_gap.h"
#include "fem/contact/contact_solver.h"
#include "fem/contact/press.h"
#include "fem/mesh/slab.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/half_space_gel.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::press_refusal;
using test::refused;
using test::target_at;
using test::Worst;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRadius = 8.0;
const RoundedCylinder kProbe{3.0, 0.5, 5.0};

const Compliance& gel() {
  static const Compliance made = [] {
    const SlabMesh slab;
    std::vector<Bead> beads;
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) beads.push_back({{2.0 * i, 2.0 * j, -0.5}, 0.25});
    }
    return compute_compliance(mesh_slab(slab), {0.33, 0.49}, beads, slab.thickness);
  }();
  return made;
}

PressTarget sphere_at(double x, double y, double depth) {
  return target_at(x, y, kRadius - depth);
}

PressTolerance tight() {
  PressTolerance tolerance;
  tolerance.lookup_mm = 1e-11;
  tolerance.traction = 1e-12;
  return tolerance;
}

void expect_contact_laws(const PressState& state) {
  EXPECT_TRUE(state.traction.allFinite());
  EXPECT_TRUE(state.wrench.allFinite());
  EXPECT_LT(state.largest_penetration, 1e-5);
  EXPECT_LT(state.largest_tension, 1e-10);
  EXPECT_LT(state.cone_violation, 1e-8);
}

/// The same gel seen in another frame, its vertices in another order.
Compliance transformed(const Compliance& from, const Eigen::Matrix3d& turn, const std::vector<int>& order) {
  Compliance to = from;
  Eigen::MatrixXd surface = from.surface.view();
  Eigen::MatrixXd beads = from.beads.view();
  const auto n = static_cast<int>(from.vertices.size());
  std::vector<int> place(n);
  for (int k = 0; k < n; ++k) place[order[k]] = k;
  std::vector<Eigen::Triplet<double>> mass;
  for (int j = 0; j < n; ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(from.mass, j); it; ++it) {
      mass.emplace_back(place[it.row()], place[j], it.value());
    }
    to.vertices[place[j]] = turn * from.vertices[j];
    beads.middleCols<3>(3 * place[j]) = from.beads.view().middleCols<3>(3 * j) * turn.transpose();
    for (int i = 0; i < n; ++i) {
      surface.block<3, 3>(3 * place[i], 3 * place[j]) =
          turn * from.surface.view().block<3, 3>(3 * i, 3 * j) * turn.transpose();
    }
  }
  for (Eigen::Index b = 0; b + 2 < beads.rows(); b += 3) {
    beads.middleRows<3>(b) = (turn * beads.middleRows<3>(b)).eval();
  }
  to.surface = std::move(surface);
  to.beads = std::move(beads);
  to.mass.setFromTriplets(mass.begin(), mass.end());
  const bool mirrored = turn.determinant() < 0.0;
  for (auto& t : to.triangles) {
    for (int& v : t) v = place[v];
    if (mirrored) std::swap(t[1], t[2]);
  }
  return to;
}

void add_box(TriangleMesh& mesh, const Eigen::Vector3d& centre, const Eigen::Vector3d& size) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign((corner & 1) ? 0.5 : -0.5, (corner & 2) ? 0.5 : -0.5, (corner & 4) ? 0.5 : -0.5);
    mesh.vertices.push_back(centre + sign.cwiseProduct(size));
  }
  for (const auto& t : std::vector<std::array<int, 3>>{{0, 2, 1},
                                                       {1, 2, 3},
                                                       {4, 5, 6},
                                                       {5, 7, 6},
                                                       {0, 1, 4},
                                                       {1, 5, 4},
                                                       {2, 6, 3},
                                                       {3, 6, 7},
                                                       {0, 4, 2},
                                                       {2, 4, 6},
                                                       {1, 3, 5},
                                                       {3, 7, 5}}) {
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

TEST(HardCase6, ContactOverThePadsEdgeIsFiniteAndWeaker) {
  const double inside = Press(gel(), SphereShape{kRadius}, 0.3).step(sphere_at(0, 0, 0.4)).wrench[2];
  for (const auto& [x, y] : {std::pair{10.0, 0.0}, {10.0, 10.0}, {10.5, -10.5}}) {
    Press press(gel(), SphereShape{kRadius}, 0.3);
    const PressState& state = press.step(sphere_at(x, y, 0.4));
    expect_contact_laws(state);
    EXPECT_GT(state.wrench[2], 0.0);
    EXPECT_LT(state.wrench[2], inside);
    did("a ball 0.4 mm deep with its middle at ({}, {}) mm on a pad of 20 x 20 mm meets {:.4g} N, in the middle {:.4g} "
        "N",
        x, y, state.wrench[2], inside);
  }
}

TEST(HardCase7, AMissHasExactlyNoForce) {
  Press press(gel(), kProbe, 0.5);
  Worst force{0.0};
  Worst beads{0.0};
  for (const auto& target : {target_at(0, 0, 1e-9), target_at(0, 0, 3), target_at(40, 0, -1)}) {
    const PressState& state = press.step(target);
    EXPECT_EQ(force(state.wrench.cwiseAbs().maxCoeff()), 0.0);
    EXPECT_EQ(beads(state.bead_displacement.cwiseAbs().maxCoeff()), 0.0);
  }
  did("a probe 1e-9 mm and 3 mm over the gel and one beside it: largest force or torque {} N, beads move by {} mm",
      force.seen, beads.seen);
}

TEST(HardCase8, OverlapDeeperThanTheGelIsRefused) {
  Press press(gel(), kProbe, 0.5);
  const std::string message = press_refusal(press, target_at(0, 0, -5.01));
  EXPECT_NE(message.find("5.01 mm into a gel of 5 mm"), std::string::npos);
  did("{}", refused(message));
  EXPECT_EQ(press.state().wrench.norm(), 0.0);
}

TEST(HardCase9, NoFrictionIsBitwiseTheFrictionlessPath) {
  Press zero(gel(), kProbe, 0.0);
  Press negative_zero(gel(), kProbe, -0.0);
  Worst traction{0.0};
  Worst shear{0.0};
  for (const double depth : {0.1, 0.5, 0.3}) {
    const PressState& a = zero.step(target_at(0.1, 0.2, -depth));
    const PressState& b = negative_zero.step(target_at(0.1, 0.2, -depth));
    EXPECT_EQ(traction((a.traction - b.traction).cwiseAbs().maxCoeff()), 0.0);
    EXPECT_EQ(shear(a.traction.leftCols<2>().cwiseAbs().maxCoeff()), 0.0);
    EXPECT_EQ(a.sweeps, 0);
    EXPECT_EQ(a.parts, 1);
  }
  did("tractions of mu = 0 and mu = -0 differ by {} MPa, their shear is {} MPa, and no sweep of the friction solver is "
      "run",
      traction.seen, shear.seen);
}

TEST(HardCase10, AFrictionOfFiveConvergesOrSaysSo) {
  Press press(gel(), kProbe, 5.0);
  int answered = 0;
  for (const auto& target : {target_at(0, 0, -0.3), target_at(0.1, 0, -0.3), target_at(0.3, 0.1, -0.4),
                             target_at(-0.2, 0, -0.4), target_at(0, 0, -0.1)}) {
    const std::string message = press_refusal(press, target);
    if (message.empty()) {
      ++answered;
      expect_contact_laws(press.state());
    } else {
      EXPECT_NE(message.find("converge"), std::string::npos) << message;
    }
  }
  EXPECT_GE(answered, 3);
  did("{} of 5 presses converge and keep the contact laws (penetration below 1e-5 mm, friction cone to 1e-8){}",
      answered, answered < 5 ? "; the others end in an error that says they didn't converge" : "");
}

TEST(HardCase11, AnInfiniteFrictionIsTheBondedLimit) {
  Press bonded(gel(), kProbe, kInfinity);
  bonded.step(target_at(0, 0, -0.4));
  bonded.step(target_at(0.1, 0, -0.4));
  for (const NodeState s : bonded.state().node_state) EXPECT_NE(s, NodeState::slip);
  double before = kInfinity;
  for (const double friction : {0.1, 0.3, 1.0, 1000.0}) {
    Press press(gel(), kProbe, friction);
    press.step(target_at(0, 0, -0.4));
    press.step(target_at(0.1, 0, -0.4));
    const double away = (press.state().wrench - bonded.state().wrench).norm();
    EXPECT_LE(away, before + 1e-9);
    before = away;
    did("mu = {}: {:.2g} of the bonded limit's force away from it", friction, away / bonded.state().wrench.norm());
  }
  EXPECT_LT(before, 1e-2 * bonded.state().wrench.norm());
}

TEST(HardCase14, NotANumberIsRefusedAtTheBorder) {
  Press press(gel(), kProbe, 0.5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int axis = 0; axis < 3; ++axis) {
    PressTarget target = target_at(0, 0, -0.1);
    target.axis[axis].value = nan;
    const std::string of_nan = press_refusal(press, target);
    EXPECT_NE(of_nan.find("finite"), std::string::npos);
    target.axis[axis] = AxisControl::with_force(kInfinity);
    const std::string of_infinity = press_refusal(press, target);
    EXPECT_NE(of_infinity.find("finite"), std::string::npos);
    if (axis == 2) did("a pose of NaN is {}\na force of infinity is {}", refused(of_nan), refused(of_infinity));
  }
}

TEST(HardCase19, TwoObjectsEqualTheJointProblem) {
  // Two boxes moved as one, as two bodies and as one mesh: pressed, then sheared.
  const Eigen::Vector3d size(1.1, 1.3, 1.0);
  const Eigen::Vector3d left(-1.4, 0.1, 0.5);
  const Eigen::Vector3d right(1.3, -0.2, 0.5);
  TriangleMesh both;
  add_box(both, left, size);
  add_box(both, right, size);
  const Compliance flat_gel = test::half_space_gel(3.0, 0.25, {1.0, 0.49}, 10.0);
  // Where outlines cut hats, they are looked up where each body's patch of contact has moved to; the one mesh has one
  // patch, between the two.
  Worst away{1e-9};  // rounding: both take the same vertices, and whole hats don't ask where exactly the outlines are
  Worst away_cut{2e-3};
  for (const bool outlines : {false, true}) {
    PressTolerance tolerance;
    tolerance.outlines = outlines;
    Press joint(flat_gel, MeshShape(both), 0.4, tolerance);
    Press apart(flat_gel, std::vector<PressBody>{{BoxShape{size}, 0.4, nullptr}, {BoxShape{size}, 0.4, nullptr}},
                tolerance);
    for (const Eigen::Vector3d& offset : {Eigen::Vector3d(0, 0, -0.15), Eigen::Vector3d(0.03, 0.01, -0.15)}) {
      const PressState& one = joint.step(target_at(offset.x(), offset.y(), offset.z()));
      const std::array<PressTarget, 2> targets = {
          target_at(left.x() + offset.x(), left.y() + offset.y(), left.z() + offset.z()),
          target_at(right.x() + offset.x(), right.y() + offset.y(), right.z() + offset.z())};
      const PressState& two = apart.step(targets);
      ASSERT_EQ(two.bodies.size(), 2u);
      EXPECT_GT(two.bodies[1].wrench[2], 0.01);
      const Eigen::Matrix<double, 6, 1> sum = two.bodies[0].wrench + two.bodies[1].wrench;
      Worst& worst = outlines ? away_cut : away;
      EXPECT_LT(worst((sum - one.wrench).norm() / one.wrench.norm()), worst.bar);
      EXPECT_EQ(two.contact_vertices, one.contact_vertices);
    }
  }
  did("two boxes pressed and sheared as two objects and as one mesh: the sum of their forces differs by {}",
      away.text("relative"));
}

TEST(HardCase20, StickSlipAndReversalConvergeUnderStepHalving) {
  const auto shear_after = [](int steps) {
    Press press(gel(), SphereShape{kRadius}, 0.4);
    press.step(sphere_at(0, 0, 0.4));
    double x = 0.0;
    for (const double end : {0.25, -0.1, 0.05}) {
      const double begin = x;
      for (int k = 1; k <= steps; ++k) {
        x = begin + (end - begin) * k / steps;
        press.step(sphere_at(x, 0, 0.4));
        expect_contact_laws(press.state());
      }
    }
    return press.state().wrench[0];
  };
  const double reference = shear_after(16);
  double before = kInfinity;
  for (const int steps : {2, 4, 8}) {
    const double error = std::abs(shear_after(steps) - reference);
    EXPECT_LT(error, 0.8 * before) << steps;
    before = error;
    did("{} steps a stroke: shear force {:.2g} from that of 16 steps, relative", steps, error / std::abs(reference));
  }
  EXPECT_LT(before, 1e-3 * std::abs(reference));
}

TEST(HardCase21, AUniformPressureComesBackAsUniformMultipliers) {
  // A frictionless body of just the shape that a uniform pressure presses into the gel.
  const double pressure = 0.02;
  const auto n = static_cast<Eigen::Index>(gel().vertices.size());
  const Eigen::MatrixXd normal =
      gel().surface.view()(Eigen::seqN(2, n, Eigen::fix<3>), Eigen::seqN(2, n, Eigen::fix<3>));
  ContactProblem problem;
  problem.compliance.emplace(normal);
  problem.gap = -(normal * Eigen::VectorXd::Constant(n, pressure));
  problem.border.resize(n, 0);
  problem.force.resize(0);
  ContactMemory memory;
  const ContactAnswer answer = solve_frictionless(problem, {}, memory);
  ASSERT_TRUE(answer.converged);
  Worst away{1e-10};
  EXPECT_LT(away((answer.z.array() - pressure).abs().maxCoeff() / pressure), away.bar);
  did("a pressure of {} MPa comes back at {} vertices with a relative error of {}", pressure, n, away.text());
}

TEST(HardCase22, AContactSmallerThanATriangleDoesNotOscillateAndWarns) {
  Press press(gel(), SphereShape{0.3}, 0.3);
  double before = 0.0;
  for (int k = 1; k <= 10; ++k) {
    const PressState& state = press.step(target_at(0.11, 0.07, 0.3 - 0.02 * k));
    expect_contact_laws(state);
    EXPECT_TRUE(state.under_resolved);
    EXPECT_GE(state.wrench[2], before);  // deeper is never weaker
    before = state.wrench[2];
  }
  did("a ball of 0.3 mm radius pressed in ten steps to 0.2 mm: the force rises in each, to {:.3g} N, and each is "
      "marked as "
      "under-resolved",
      before);
}

TEST(HardCase23, UnloadingLeavesNoForceWithoutHistory) {
  for (const double friction : {0.0, 0.5}) {
    Press press(gel(), kProbe, friction);
    press.step(target_at(0, 0, -0.5));
    press.step(target_at(0.2, 0, -0.5));
    press.step(target_at(0.2, 0, -0.1));
    const PressState& state = press.step(target_at(0.2, 0, 0.01));
    EXPECT_EQ(state.wrench.norm(), 0.0);
    EXPECT_EQ(state.traction.norm(), 0.0);
    EXPECT_EQ(state.bead_displacement.norm(), 0.0);
    did("pressed by 0.5 mm, sheared and lifted with mu = {}: {} N, {} MPa, beads {} mm", friction, state.wrench.norm(),
        state.traction.norm(), state.bead_displacement.norm());
  }
}

TEST(HardCase24, TheComplianceIsSymmetricPositiveDefinite) {
  const Eigen::MatrixXd surface = gel().surface.view();
  Worst skew{1e-12};
  EXPECT_LT(skew((surface - surface.transpose()).cwiseAbs().maxCoeff() / surface.cwiseAbs().maxCoeff()), skew.bar);
  const Eigen::LLT<Eigen::MatrixXd> factor(surface);
  EXPECT_EQ(factor.info(), Eigen::Success);
  did("the compliance H ({0} x {0}) is symmetric to {1} of its largest entry and {2}", surface.rows(), skew.text(),
      factor.info() == Eigen::Success ? "has a Cholesky factor" : "has no Cholesky factor");
}

TEST(HardCase24, RotationMirrorAndPermutationDoNotChangeTheAnswer) {
  const auto n = static_cast<int>(gel().vertices.size());
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  RandomStream random(3, 0, Purpose::kTest);
  for (int k = n - 1; k > 0; --k) std::swap(order[k], order[static_cast<int>(random.uniform() * (k + 1))]);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d mirrored = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  Worst force{1e-8};
  Worst torque{1e-8};
  Worst traction{1e-7};
  Worst beads{1e-8};
  for (const Eigen::Matrix3d& turn : {turned, mirrored}) {
    const Compliance other = transformed(gel(), turn, order);
    for (const double friction : {0.0, 0.5}) {
      Press here(gel(), SphereShape{kRadius}, friction, tight());
      Press there(other, SphereShape{kRadius}, friction, tight());
      for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.3, 0.1, kRadius - 0.3), {0.4, 0.1, kRadius - 0.3}}) {
        const Eigen::Vector3d q = turn * p;
        const PressState& a = here.step(target_at(p.x(), p.y(), p.z()));
        const PressState& b = there.step(target_at(q.x(), q.y(), q.z()));
        EXPECT_LT(force((turn * a.wrench.head<3>() - b.wrench.head<3>()).norm() / a.wrench.norm()), force.bar);
        // A torque is an axial vector.
        const Eigen::Vector3d turned_torque = turn.determinant() * turn * a.wrench.tail<3>();
        EXPECT_LT(torque((turned_torque - b.wrench.tail<3>()).norm() / a.wrench.norm()), torque.bar);
        for (int k = 0; k < n; ++k) {
          EXPECT_LT(traction((turn * a.traction.row(order[k]).transpose() - b.traction.row(k).transpose()).norm()),
                    traction.bar);
        }
        EXPECT_LT(beads((a.bead_displacement * turn.transpose() - b.bead_displacement).norm()), beads.bar);
      }
    }
  }
  did("turned by 40 degrees and mirrored, vertices shuffled, with and without friction: force differs by {}, torque by "
      "{}, tractions by {}, beads by {}",
      force.text("relative"), torque.text("mm of it"), traction.text("MPa"), beads.text("mm"));
}

TEST(HardCase25, AShearAtTheFrictionLimitIsReportedAsGrossSlip) {
  Press press(gel(), kProbe, 0.6);
  PressTarget target = target_at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(2.0);
  press.step(target);
  target.axis[0] = AxisControl::with_force(0.6 * 2.0);
  const std::string message = press_refusal(press, target);
  EXPECT_NE(message.find("gross slip"), std::string::npos);
  EXPECT_NE(message.find("1.2"), std::string::npos);  // the number that can't be had
  target.axis[0] = AxisControl::with_force(0.9 * 0.6 * 2.0);
  EXPECT_EQ(press_refusal(press, target), "");
  EXPECT_NEAR(press.state().wrench[0], 1.08, 1e-6);
  did("1.2 N of shear under 2 N with mu = 0.6 is {}\n1.08 N of shear is met to {:.1g} N", refused(message),
      std::abs(press.state().wrench[0] - 1.08));
}

TEST(HardCase26, AnObjectMovedByANanometreMovesTheAnswerAsLittle) {
  Worst force{1e-7};
  Worst beads{1e-7};
  for (const double friction : {0.0, 0.5}) {
    for (int k = 0; k < 6; ++k) {
      const double x = 0.171 * k;
      Press here(gel(), SphereShape{kRadius}, friction, tight());
      Press there(gel(), SphereShape{kRadius}, friction, tight());
      const PressState& a = here.step(sphere_at(x, 0.05, 0.3));
      const PressState& b = there.step(sphere_at(x + 1e-9, 0.05, 0.3 + 1e-9));
      EXPECT_LT(force((a.wrench - b.wrench).norm()), force.bar);
      EXPECT_LT(beads((a.bead_displacement - b.bead_displacement).norm()), beads.bar);
    }
  }
  did("a ball moved by 1e-9 mm at six places, with and without friction: force moves by {}, beads by {}",
      force.text("N"), beads.text("mm"));
}

TEST(HardCase20, ALoadCycleOfTheVhsProbeHoldsTheLawsThroughout) {
  // The verification of [VisioHaptic2024, secs. 4.3 and 4.4]: to 5 N, then sheared to and fro.
  Press press(gel(), kProbe, 0.6);
  PressTarget target = target_at(0, 0, 0);
  Worst force{5e-6};
  Worst residual{1e-6};
  const auto step = [&] {
    const PressState& state = press.step(target);
    expect_contact_laws(state);
    EXPECT_LT(residual(state.force_residual), residual.bar);
    for (int a = 0; a < 3; ++a) {
      if (target.axis[a].kind == AxisControl::Kind::force) {
        EXPECT_LT(force(std::abs(state.wrench[a] - target.axis[a].value)), force.bar);
      }
    }
  };
  for (int k = 1; k <= 10; ++k) {
    target.axis[2] = AxisControl::with_force(0.5 * k);
    step();
  }
  const double deep = press.state().gel_from_object.translation.z();
  EXPECT_LT(deep, -0.5);
  for (const double shear : {-0.5, -1.0, -1.5, -0.7, 0.3, 1.2, 1.5, 0.0}) {
    target.axis[0] = AxisControl::with_force(shear);
    step();
  }
  for (int k = 9; k >= 0; --k) {
    target.axis[2] = AxisControl::with_force(0.5 * k);
    step();
  }
  EXPECT_EQ(press.state().wrench.norm(), 0.0);
  did("pressed to 5 N by force, sheared to and fro by up to 1.5 N and let go: each force is met to {}, at the end it "
      "is {} N",
      force.text("N"), press.state().wrench.norm());
}

}  // namespace
}  // namespace touchstone::fem
