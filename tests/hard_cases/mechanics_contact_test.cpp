// The hard cases of shared/DESIGN.md that concern contact, on the gel of the vhs sensor. Each says what a good program
// does with the case. Cases 6-11, 14, 20-26; the unit form of case 12 is Press.ScalesWithUnits.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "fem/contact_gap.h"
#include "fem/contact_solver.h"
#include "fem/press.h"
#include "fem/slab.h"

namespace touchstone::fem {
namespace {

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

PressTarget at(double x, double y, double z) {
  PressTarget target;
  target.axis = {AxisControl::at(x), AxisControl::at(y), AxisControl::at(z)};
  return target;
}

PressTarget sphere_at(double x, double y, double depth) {
  return at(x, y, kRadius - depth);
}

PressTolerance tight() {
  PressTolerance tolerance;
  tolerance.lookup_mm = 1e-11;
  tolerance.traction = 1e-12;
  return tolerance;
}

std::string message_of(Press& press, const PressTarget& target) {
  try {
    press.step(target);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
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

TEST(HardCase6, ContactOverThePadsEdgeIsFiniteAndWeaker) {
  const double inside = Press(gel(), SphereShape{kRadius}, 0.3).step(sphere_at(0, 0, 0.4)).wrench[2];
  for (const auto& [x, y] : {std::pair{10.0, 0.0}, {10.0, 10.0}, {10.5, -10.5}}) {
    Press press(gel(), SphereShape{kRadius}, 0.3);
    const PressState& state = press.step(sphere_at(x, y, 0.4));
    expect_contact_laws(state);
    EXPECT_GT(state.wrench[2], 0.0);
    EXPECT_LT(state.wrench[2], inside);
  }
}

TEST(HardCase7, AMissHasExactlyNoForce) {
  Press press(gel(), kProbe, 0.5);
  for (const auto& target : {at(0, 0, 1e-9), at(0, 0, 3), at(40, 0, -1)}) {
    const PressState& state = press.step(target);
    EXPECT_EQ(state.wrench.cwiseAbs().maxCoeff(), 0.0);
    EXPECT_EQ(state.bead_displacement.cwiseAbs().maxCoeff(), 0.0);
  }
}

TEST(HardCase8, OverlapDeeperThanTheGelIsRefused) {
  Press press(gel(), kProbe, 0.5);
  EXPECT_NE(message_of(press, at(0, 0, -5.01)).find("5.01 mm into a gel of 5 mm"), std::string::npos);
  EXPECT_EQ(press.state().wrench.norm(), 0.0);
}

TEST(HardCase9, NoFrictionIsBitwiseTheFrictionlessPath) {
  Press zero(gel(), kProbe, 0.0);
  Press negative_zero(gel(), kProbe, -0.0);
  for (const double depth : {0.1, 0.5, 0.3}) {
    const PressState& a = zero.step(at(0.1, 0.2, -depth));
    const PressState& b = negative_zero.step(at(0.1, 0.2, -depth));
    EXPECT_EQ((a.traction - b.traction).cwiseAbs().maxCoeff(), 0.0);
    EXPECT_EQ(a.traction.leftCols<2>().cwiseAbs().maxCoeff(), 0.0);
    EXPECT_EQ(a.sweeps, 0);
    EXPECT_EQ(a.parts, 1);
  }
}

TEST(HardCase10, AFrictionOfFiveConvergesOrSaysSo) {
  Press press(gel(), kProbe, 5.0);
  int answered = 0;
  for (const auto& target : {at(0, 0, -0.3), at(0.1, 0, -0.3), at(0.3, 0.1, -0.4), at(-0.2, 0, -0.4), at(0, 0, -0.1)}) {
    const std::string message = message_of(press, target);
    if (message.empty()) {
      ++answered;
      expect_contact_laws(press.state());
    } else {
      EXPECT_NE(message.find("converge"), std::string::npos) << message;
    }
  }
  EXPECT_GE(answered, 3);
}

TEST(HardCase11, AnInfiniteFrictionIsTheBondedLimit) {
  Press bonded(gel(), kProbe, kInfinity);
  bonded.step(at(0, 0, -0.4));
  bonded.step(at(0.1, 0, -0.4));
  for (const NodeState s : bonded.state().node_state) EXPECT_NE(s, NodeState::slip);
  double before = kInfinity;
  for (const double friction : {1.0, 4.0, 1000.0}) {
    Press press(gel(), kProbe, friction);
    press.step(at(0, 0, -0.4));
    press.step(at(0.1, 0, -0.4));
    const double away = (press.state().wrench - bonded.state().wrench).norm();
    EXPECT_LE(away, before + 1e-9);
    before = away;
  }
  EXPECT_LT(before, 1e-2 * bonded.state().wrench.norm());
}

TEST(HardCase14, NotANumberIsRefusedAtTheBorder) {
  Press press(gel(), kProbe, 0.5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int axis = 0; axis < 3; ++axis) {
    PressTarget target = at(0, 0, -0.1);
    target.axis[axis].value = nan;
    EXPECT_NE(message_of(press, target).find("finite"), std::string::npos);
    target.axis[axis] = AxisControl::with_force(kInfinity);
    EXPECT_NE(message_of(press, target).find("finite"), std::string::npos);
  }
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
  problem.compliance = &normal;
  problem.gap = -(normal * Eigen::VectorXd::Constant(n, pressure));
  problem.border.resize(n, 0);
  problem.force.resize(0);
  ContactMemory memory;
  const ContactAnswer answer = solve_frictionless(problem, {}, memory);
  ASSERT_TRUE(answer.converged);
  EXPECT_LT((answer.z.array() - pressure).abs().maxCoeff(), 1e-10 * pressure);
}

TEST(HardCase22, AContactSmallerThanATriangleDoesNotOscillateAndWarns) {
  Press press(gel(), SphereShape{0.3}, 0.3);
  double before = 0.0;
  for (int k = 1; k <= 10; ++k) {
    const PressState& state = press.step(at(0.11, 0.07, 0.3 - 0.02 * k));
    expect_contact_laws(state);
    EXPECT_TRUE(state.under_resolved);
    EXPECT_GE(state.wrench[2], before);  // deeper is never weaker
    before = state.wrench[2];
  }
}

TEST(HardCase23, UnloadingLeavesNoForceWithoutHistory) {
  for (const double friction : {0.0, 0.5}) {
    Press press(gel(), kProbe, friction);
    press.step(at(0, 0, -0.5));
    press.step(at(0.2, 0, -0.5));
    press.step(at(0.2, 0, -0.1));
    const PressState& state = press.step(at(0.2, 0, 0.01));
    EXPECT_EQ(state.wrench.norm(), 0.0);
    EXPECT_EQ(state.traction.norm(), 0.0);
    EXPECT_EQ(state.bead_displacement.norm(), 0.0);
  }
}

TEST(HardCase24, TheComplianceIsSymmetricPositiveDefinite) {
  const Eigen::MatrixXd surface = gel().surface.view();
  EXPECT_LT((surface - surface.transpose()).cwiseAbs().maxCoeff(), 1e-12 * surface.cwiseAbs().maxCoeff());
  const Eigen::LLT<Eigen::MatrixXd> factor(surface);
  EXPECT_EQ(factor.info(), Eigen::Success);
}

TEST(HardCase24, RotationMirrorAndPermutationDoNotChangeTheAnswer) {
  const auto n = static_cast<int>(gel().vertices.size());
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  RandomStream random(3, 0, Purpose::kTest);
  for (int k = n - 1; k > 0; --k) std::swap(order[k], order[static_cast<int>(random.uniform() * (k + 1))]);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d mirrored = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  for (const Eigen::Matrix3d& turn : {turned, mirrored}) {
    const Compliance other = transformed(gel(), turn, order);
    for (const double friction : {0.0, 0.5}) {
      Press here(gel(), SphereShape{kRadius}, friction, tight());
      Press there(other, SphereShape{kRadius}, friction, tight());
      for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.3, 0.1, kRadius - 0.3), {0.4, 0.1, kRadius - 0.3}}) {
        const Eigen::Vector3d q = turn * p;
        const PressState& a = here.step(at(p.x(), p.y(), p.z()));
        const PressState& b = there.step(at(q.x(), q.y(), q.z()));
        EXPECT_LT((turn * a.wrench.head<3>() - b.wrench.head<3>()).norm(), 1e-8 * a.wrench.norm());
        // A torque is an axial vector.
        EXPECT_LT((turn.determinant() * turn * a.wrench.tail<3>() - b.wrench.tail<3>()).norm(), 1e-8 * a.wrench.norm());
        for (int k = 0; k < n; ++k) {
          EXPECT_LT((turn * a.traction.row(order[k]).transpose() - b.traction.row(k).transpose()).norm(), 1e-7);
        }
        EXPECT_LT((a.bead_displacement * turn.transpose() - b.bead_displacement).norm(), 1e-8);
      }
    }
  }
}

TEST(HardCase25, AShearAtTheFrictionLimitIsReportedAsGrossSlip) {
  Press press(gel(), kProbe, 0.6);
  PressTarget target = at(0, 0, 0);
  target.axis[2] = AxisControl::with_force(2.0);
  press.step(target);
  target.axis[0] = AxisControl::with_force(0.6 * 2.0);
  const std::string message = message_of(press, target);
  EXPECT_NE(message.find("gross slip"), std::string::npos);
  EXPECT_NE(message.find("1.2"), std::string::npos);  // the number that can't be had
  target.axis[0] = AxisControl::with_force(0.9 * 0.6 * 2.0);
  EXPECT_EQ(message_of(press, target), "");
  EXPECT_NEAR(press.state().wrench[0], 1.08, 1e-6);
}

TEST(HardCase26, AnObjectMovedByANanometreMovesTheAnswerAsLittle) {
  for (const double friction : {0.0, 0.5}) {
    for (int k = 0; k < 6; ++k) {
      const double x = 0.171 * k;
      Press here(gel(), SphereShape{kRadius}, friction, tight());
      Press there(gel(), SphereShape{kRadius}, friction, tight());
      const PressState& a = here.step(sphere_at(x, 0.05, 0.3));
      const PressState& b = there.step(sphere_at(x + 1e-9, 0.05, 0.3 + 1e-9));
      EXPECT_LT((a.wrench - b.wrench).norm(), 1e-7);
      EXPECT_LT((a.bead_displacement - b.bead_displacement).norm(), 1e-7);
    }
  }
}

TEST(LoadCycle, OfTheVhsProbeHoldsTheLawsAllTheWay) {
  // The paper's verification (sec. 4.3 and 4.4): to 5 N, then sheared to and fro.
  Press press(gel(), kProbe, 0.6);
  PressTarget target = at(0, 0, 0);
  const auto step = [&] {
    const PressState& state = press.step(target);
    expect_contact_laws(state);
    EXPECT_LT(state.force_residual, 1e-6);
    for (int a = 0; a < 3; ++a) {
      if (target.axis[a].kind == AxisControl::Kind::force) {
        EXPECT_NEAR(state.wrench[a], target.axis[a].value, 5e-6);
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
}

}  // namespace
}  // namespace touchstone::fem
