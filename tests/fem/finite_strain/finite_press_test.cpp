#include "fem/finite_strain/finite_press.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"
#include "fem/elements/quadrature.h"
#include "fem/finite_strain/finite_contact.h"
#include "fem/finite_strain/linear_range.h"
#include "fem/mesh/gel_body.h"
#include "tests/fem/mesh/box_mesh.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::target_at;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRadius = 5.0;
constexpr double kThickness = 3.0;
const std::vector<ElasticMaterial> kSoft = {{0.33, 0.49}};
const std::vector<ElasticMaterial> kIncompressible = {{0.33, 0.5}};

TetMesh pad(int cells = 8) {
  return fixtures::box_mesh({8, 8, kThickness}, cells, cells, cells / 2);
}

const FiniteGel& soft_gel() {
  static const FiniteGel gel(pad(), kSoft, std::vector<Bead>{{{0.3, -0.2, -1.0}, 0.25}}, kThickness);
  return gel;
}

PressTarget sphere_at(double depth) {
  return target_at(0, 0, kRadius - depth);
}

std::string message_of(FinitePress& press, const PressTarget& target) {
  try {
    press.step(target);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(FinitePress, AMissGivesExactlyZero) {
  FinitePress press(soft_gel(), SphereShape{kRadius}, 0.5);
  for (const auto& target : {sphere_at(-0.1), target_at(100, 0, 0), sphere_at(0.0)}) {
    const PressState& state = press.step(target);
    EXPECT_EQ(state.wrench.norm(), 0.0);
    EXPECT_EQ(state.surface_displacement.norm(), 0.0);
    EXPECT_EQ(press.stored_energy(), 0.0);
  }
}

/// A gel at rest has no forces that a residual could be measured by. Just below the touch a step may find no vertex
/// that touches, as here below the one that a plate meets first.
TEST(FinitePress, LetGoTheGelComesToRest) {
  FingertipGel tip;
  tip.fine = 2.5;
  tip.coarse = 4.0;
  const FiniteGel gel(mesh_gel(tip), kSoft, {}, thickness_of(tip));
  for (const double friction : {0.0, 0.5}) {
    FinitePress press(gel, BoxShape{{60, 60, 30}}, friction);
    const double touch = press.touching({})->translation.z();
    for (const double depth : {-0.5, 0.0, 1e-12, 1e-3}) {
      EXPECT_GT(press.step(target_at(0, 0, touch - 0.6)).wrench[2], 0.1);
      const PressState& state = press.step(target_at(0, 0, touch - depth));
      EXPECT_LT(state.wrench[2], 1e-2) << depth;
      EXPECT_LT(state.factorisations, 30) << depth;
      const double left = state.contact_vertices == 0 ? state.surface_displacement.norm() : 0.0;
      EXPECT_LT(left, 1e-9) << depth;
    }
  }
}

/// The weighted gap of the gel at rest is the linear press's own.
TEST(FinitePress, TheGapAtRestIsTheLinearOne) {
  const FiniteGel& gel = soft_gel();
  for (const ContactShape& shape : {ContactShape(SphereShape{kRadius}), ContactShape(BoxShape{{3.1, 2.3, 1.0}})}) {
    RigidTransform pose;
    pose.translation = {0.13, -0.21, bounding_ball(shape).radius - 0.5};
    const WeightedGap linear = weighted_gap(gel.rest, shape, pose);
    const ElasticSolution rest = gel.problem.at_rest();
    const double overlap = std::max(0.0, -linear.deepest);
    const GapLines lines = gap_lines(gel.space, gel.outer, rest.displacement, shape, pose, overlap);
    const DeformedGap found = deformed_gap(gel.space, gel.outer, gel.rest.weight, lines, rest.displacement, shape, pose,
                                           overlap, Eigen::VectorXd::Zero(gel.rest.weight.size()));
    for (Eigen::Index v = 0; v < linear.weighted.size(); ++v) {
      // Beside a sphere's flank the lines that only graze it are left out.
      if (std::isfinite(linear.weighted[v]) && gel.rest.vertices[v].head<2>().norm() < 3.0) {
        EXPECT_NEAR(found.weighted[v], linear.weighted[v], 1e-6 * gel.rest.weight[v]);
      }
    }
  }
}

/// Gradient and curvature of the gap are its derivatives, where the body is smooth.
TEST(FinitePress, TheGapsDerivativesAreWhatTheySay) {
  const FiniteGel& gel = soft_gel();
  const ContactShape shape = SphereShape{kRadius};
  RigidTransform pose;
  pose.translation = {0.1, 0.05, kRadius - 0.4};
  pose.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const auto field = [&](double size, double phase) {
    Eigen::MatrixX3d u(gel.space.nodes, 3);
    for (int node = 0; node < gel.space.nodes; ++node) {
      const Eigen::Vector3d x = gel.space.position(node);
      u.row(node) << std::sin(x.y() + phase), std::cos(x.x() - phase), std::sin(x.x() * x.y() + phase);
    }
    return Eigen::MatrixX3d(size * u);
  };
  const Eigen::MatrixX3d state = field(0.05, 0.3);
  const Eigen::MatrixX3d change = field(1.0, 1.1);
  Eigen::VectorXd pressure = Eigen::VectorXd::LinSpaced(gel.rest.weight.size(), 0.5, 1.0);
  for (Eigen::Index v = 0; v < pressure.size(); ++v) {
    if (gel.rest.vertices[v].head<2>().norm() > 2.2) pressure[v] = 0.0;  // the sphere's flank
  }
  const GapLines lines = gap_lines(gel.space, gel.outer, state, shape, pose, 0.4);
  const auto gap = [&](double step) {
    return deformed_gap(gel.space, gel.outer, gel.rest.weight, lines, state + step * change, shape, pose, 0.4,
                        pressure);
  };
  constexpr double kStep = 1e-4;
  const DeformedGap here = gap(0.0);
  const DeformedGap up = gap(kStep);
  const DeformedGap down = gap(-kStep);
  Eigen::VectorXd flat(3 * gel.space.nodes);
  for (int node = 0; node < gel.space.nodes; ++node) flat.segment<3>(3 * node) = change.row(node).transpose();
  const Eigen::VectorXd slope = here.gradient * flat;
  double bent = 0.0;
  int seen = 0;
  for (int v = 0; v < static_cast<int>(gel.rest.vertices.size()); ++v) {
    if (gel.rest.vertices[v].head<2>().norm() > 2.2 || !std::isfinite(here.weighted[v])) continue;
    EXPECT_NEAR(slope[v], (up.weighted[v] - down.weighted[v]) / (2 * kStep), 1e-6 * gel.rest.weight[v]);
    ++seen;
  }
  EXPECT_GT(seen, 10);
  for (Eigen::Index v = 0; v < pressure.size(); ++v) {
    if (pressure[v] > 0.0)
      bent += pressure[v] * (up.weighted[v] + down.weighted[v] - 2 * here.weighted[v]) / (kStep * kStep);
  }
  const double found = flat.dot(here.curvature.front() * flat);
  EXPECT_NEAR(found, bent, 1e-3 * std::abs(bent));
}

/// A plate over the whole pad: the contact is the same at every depth, so that only the strain makes a difference.
TEST(FinitePress, SmallPressesEqualTheLinearOnes) {
  const FiniteGel& gel = soft_gel();
  const Compliance linear = compute_compliance(pad(), kSoft[0], std::vector<Bead>{{{0.3, -0.2, -1.0}, 0.25}}, 3.0);
  for (const double friction : {0.0, kInfinity}) {
    double before = 0.0;
    for (const double depth : {0.08, 0.04, 0.02}) {
      Press press(linear, BoxShape{{20, 20, 2}}, friction);
      FinitePress finite(gel, BoxShape{{20, 20, 2}}, friction);
      const PressState& a = press.step(target_at(0, 0, 1.0 - depth));
      const PressState& b = finite.step(target_at(0, 0, 1.0 - depth));
      const double difference = std::abs(b.wrench[2] / a.wrench[2] - 1.0);
      if (before > 0.0) {
        EXPECT_NEAR(before / difference, 2.0, 0.3) << friction;  // first order in the strain
      }
      EXPECT_LT(difference, 2.0 * depth);
      EXPECT_LT((b.surface_displacement - a.surface_displacement).norm(), 2.0 * depth * a.surface_displacement.norm());
      EXPECT_LT((b.bead_displacement - a.bead_displacement).norm(), 2.0 * depth * a.bead_displacement.norm());
      EXPECT_LT((b.traction - a.traction).norm(), 4.0 * depth * a.traction.norm());
      before = difference;
    }
  }
}

TEST(FinitePress, FrictionlessForceIsTheDerivativeOfTheStoredEnergy) {
  constexpr double kStep = 0.01;
  for (const double depth : {0.4, 0.9}) {
    FinitePress press(soft_gel(), SphereShape{kRadius}, 0.0);
    press.step(sphere_at(depth - kStep));
    const double below = press.stored_energy();
    const double force = press.step(sphere_at(depth)).wrench[2];
    press.step(sphere_at(depth + kStep));
    const double slope = (press.stored_energy() - below) / (2 * kStep);
    RecordProperty("error_" + std::to_string(depth), std::to_string(slope / force - 1.0));
    EXPECT_NEAR(slope, force, 2e-3 * force) << depth;
  }
}

/// The mesh is its own mirror image in x = y, and the press in its middle is too.
TEST(FinitePress, ASymmetricPressStaysSymmetric) {
  const FiniteGel& gel = soft_gel();
  FinitePress press(gel, SphereShape{kRadius}, 0.4);
  const PressState& state = press.step(sphere_at(0.6));
  EXPECT_NEAR(state.wrench[0], state.wrench[1], 1e-6 * state.wrench[2]);
  EXPECT_NEAR(state.wrench[3], -state.wrench[4], 1e-6 * state.wrench[2]);
  for (std::size_t i = 0; i < gel.rest.vertices.size(); ++i) {
    const Eigen::Vector3d mirror(gel.rest.vertices[i].y(), gel.rest.vertices[i].x(), gel.rest.vertices[i].z());
    for (std::size_t j = 0; j < gel.rest.vertices.size(); ++j) {
      if ((gel.rest.vertices[j] - mirror).norm() > 1e-9) continue;
      const auto a = static_cast<Eigen::Index>(i);
      const auto b = static_cast<Eigen::Index>(j);
      EXPECT_NEAR(state.surface_displacement(a, 0), state.surface_displacement(b, 1), 1e-5);
      EXPECT_NEAR(state.surface_displacement(a, 2), state.surface_displacement(b, 2), 1e-5);
    }
  }
}

TEST(FinitePress, HalfTheThicknessConvergesAndKeepsTheVolume) {
  const FiniteGel gel(pad(), kIncompressible, {}, kThickness);
  FinitePress press(gel, SphereShape{kRadius}, 0.0);
  const PressState& state = press.step(sphere_at(0.5 * kThickness));
  EXPECT_GT(state.wrench[2], 0.0);
  EXPECT_LT(state.largest_penetration, 1e-6);
  EXPECT_EQ(state.largest_tension, 0.0);
  double before = 0.0;
  double after = 0.0;
  for (std::size_t e = 0; e < gel.space.elements.size(); ++e) {
    const double size = volume(gel.mesh, gel.mesh.tetrahedra[e]);
    for (const auto& point : symmetric_tetrahedron_rule()) {
      const Eigen::Matrix3d gradient =
          displacement_gradient_at(gel.space, press.solution(), static_cast<int>(e), point.barycentric);
      before += point.weight * size;
      after += point.weight * size * (Eigen::Matrix3d::Identity() + gradient).determinant();
    }
  }
  EXPECT_NEAR(after, before, 1e-6 * before);
}

TEST(FinitePress, TheContactLawsHold) {
  const FiniteGel& gel = soft_gel();
  FinitePress press(gel, SphereShape{kRadius}, 0.4);
  press.step(sphere_at(0.5));
  const PressState& state = press.step(target_at(0.1, 0.05, kRadius - 0.6));
  EXPECT_LT(state.largest_penetration, 1e-5);
  EXPECT_EQ(state.largest_tension, 0.0);
  EXPECT_LT(state.cone_violation, 1e-6);
  EXPECT_GT(state.wrench[0], 0.0 - state.wrench[2]);
  // Nominal tractions over undeformed hats make up the force.
  const Eigen::Vector3d sum = (gel.mass * state.traction).colwise().sum();
  EXPECT_LT((sum + state.wrench.head<3>()).norm(), 0.01 * state.wrench[2]);
}

/// A sphere drawn over the gel slides in the end with the friction's force against it.
TEST(FinitePress, ADraggedSphereSlidesAtTheFrictionsLimit) {
  constexpr double kMu = 0.2;
  FinitePress press(soft_gel(), SphereShape{kRadius}, kMu);
  press.step(sphere_at(0.4));
  for (const double x : {0.1, 0.2, 0.4}) press.step(target_at(x, 0, kRadius - 0.4));
  const PressState& state = press.state();
  EXPECT_LT(state.wrench[0], 0.0);
  // The gel also stands in the way like a wave before a ship: a few percent of the normal force.
  EXPECT_NEAR(-state.wrench[0], kMu * state.wrench[2], 0.2 * kMu * state.wrench[2]);
}

TEST(FinitePress, FrictionStiffens) {
  double before = 0.0;
  for (const double friction : {0.0, 0.3, kInfinity}) {
    FinitePress press(soft_gel(), SphereShape{kRadius}, friction);
    const double force = press.step(sphere_at(0.8)).wrench[2];
    EXPECT_GT(force, before);
    before = force;
  }
}

TEST(FinitePress, AWantedForceIsMet) {
  FinitePress press(soft_gel(), SphereShape{kRadius}, 0.3);
  PressTarget target;
  target.axis[2] = AxisControl::with_force(1.5);
  const PressState& state = press.step(target);
  EXPECT_NEAR(state.wrench[2], 1.5, 1e-5);
  // The same depth by position gives the same force.
  FinitePress other(soft_gel(), SphereShape{kRadius}, 0.0);
  target.axis[2] = AxisControl::with_force(1.5);
  const double height = other.step(target).gel_from_object.translation.z();
  FinitePress third(soft_gel(), SphereShape{kRadius}, 0.0);
  EXPECT_NEAR(third.step(target_at(0, 0, height)).wrench[2], 1.5, 1e-4);
}

// A ball smaller than an edge that stands over a triangle's middle: at a fiftieth of the thickness it has met no
// vertex.
TEST(FinitePress, AWantedForceIsMetByABodyThatStandsBetweenVertices) {
  FinitePress press(soft_gel(), SphereShape{1.2}, 0.3);
  PressTarget target = target_at(0.55, 0.3, 0);
  target.axis[2] = AxisControl::with_force(0.05);
  EXPECT_NEAR(press.step(target).wrench[2], 0.05, 1e-5);
}

TEST(FinitePress, ForceConvergesAsTheMeshGetsFiner) {
  double force[3];
  const int cells[] = {6, 10, 14};
  for (int k = 0; k < 3; ++k) {
    const FiniteGel gel(pad(cells[k]), kSoft, {}, kThickness);
    FinitePress press(gel, SphereShape{kRadius}, 0.0);
    force[k] = press.step(sphere_at(0.8)).wrench[2];
  }
  RecordProperty("forces", std::to_string(force[0]) + " " + std::to_string(force[1]) + " " + std::to_string(force[2]));
  EXPECT_LT(std::abs(force[2] - force[1]), std::abs(force[1] - force[0]) + 2e-3 * force[2]);
  EXPECT_LT(std::abs(force[2] - force[1]), 0.01 * force[2]);
}

TEST(FinitePress, TheSameStepsGiveTheSameBytes) {
  FinitePress one(soft_gel(), SphereShape{kRadius}, 0.3);
  FinitePress other(soft_gel(), SphereShape{kRadius}, 0.3);
  EXPECT_EQ(one.step(sphere_at(0.3)).traction, other.step(sphere_at(0.3)).traction);
}

TEST(FinitePress, BadTargetsAreRefusedAndChangeNothing) {
  FinitePress press(soft_gel(), SphereShape{kRadius}, 0.0);
  press.step(sphere_at(0.3));
  const double force = press.state().wrench[2];
  EXPECT_NE(message_of(press, sphere_at(3.2)).find("mm into a gel of 3 mm"), std::string::npos);
  PressTarget target;
  target.axis[2] = AxisControl::with_force(-1.0);
  EXPECT_NE(message_of(press, target).find("contact can't pull"), std::string::npos);
  target.axis[2] = AxisControl::with_force(1.0);
  target.axis[0] = AxisControl::with_force(0.5);
  EXPECT_NE(message_of(press, target).find("gross slip"), std::string::npos);
  target = sphere_at(0.3);
  target.axis[0].value = std::nan("");
  EXPECT_NE(message_of(press, target), "");
  EXPECT_EQ(press.state().wrench[2], force);
  EXPECT_THROW(FinitePress(soft_gel(), SphereShape{-1.0}, 0.0), Error);
  EXPECT_THROW(FinitePress(soft_gel(), SphereShape{1.0}, -0.1), Error);
  EXPECT_THROW(FiniteGel(pad(), kSoft, {}, 0.0), Error);
}

TEST(LinearRange, TheDifferenceGrowsWithDepthFromNothing) {
  const Compliance linear = compute_compliance(pad(), kSoft[0], {}, kThickness);
  const FiniteGel gel(pad(), kSoft, {}, kThickness);
  const double depths[] = {0.01, 0.05, 0.15};
  const auto range = measure_linear_range(linear, gel, BoxShape{{20, 20, 2}}, 0.0, depths);
  ASSERT_EQ(range.size(), 3u);
  EXPECT_LT(std::abs(range[0].difference()), 0.02);
  for (std::size_t k = 1; k < range.size(); ++k) {
    EXPECT_GT(range[k].finite_force, range[k - 1].finite_force);
    EXPECT_GT(std::abs(range[k].difference()), std::abs(range[k - 1].difference()));
  }
  EXPECT_DOUBLE_EQ(range[1].depth, 0.15);
}

TEST(LinearRange, BadDepthsAreRefused) {
  const Compliance linear = compute_compliance(pad(), kSoft[0], {}, kThickness);
  const FiniteGel gel(pad(), kSoft, {}, kThickness);
  const double falling[] = {0.02, 0.01};
  EXPECT_THROW(measure_linear_range(linear, gel, BoxShape{{20, 20, 2}}, 0.0, falling), Error);
}

}  // namespace
}  // namespace touchstone::fem
