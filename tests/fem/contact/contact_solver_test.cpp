#include "fem/contact/contact_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "tests/support/half_space_gel.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A random symmetric positive definite matrix with all signs in it.
Eigen::MatrixXd random_compliance(int size, std::uint64_t seed) {
  RandomStream random(seed, 0, Purpose::kTest);
  Eigen::MatrixXd a(size, size);
  for (double& x : a.reshaped()) x = random.normal();
  return a * a.transpose() / size + 0.05 * Eigen::MatrixXd::Identity(size, size);
}

Eigen::VectorXd random_vector(int size, std::uint64_t seed) {
  RandomStream random(seed, 1, Purpose::kTest);
  Eigen::VectorXd v(size);
  for (double& x : v) x = random.normal();
  return v;
}

ContactProblem frictionless(const Eigen::MatrixXd& a, const Eigen::VectorXd& gap) {
  ContactProblem problem;
  problem.compliance.emplace(a);
  problem.gap = gap;
  problem.border.resize(gap.size(), 0);
  problem.force.resize(0);
  return problem;
}

void expect_kkt(const ContactProblem& problem, const ContactAnswer& answer) {
  ASSERT_TRUE(answer.converged);
  const Eigen::VectorXd g = problem.gap + *problem.compliance * answer.z + problem.border * answer.shift;
  for (Eigen::Index i = 0; i < g.size(); ++i) {
    EXPECT_GE(answer.z[i], 0.0);
    if (!std::isfinite(problem.gap[i])) {
      EXPECT_EQ(answer.z[i], 0.0);
      continue;
    }
    EXPECT_GE(g[i], -1e-12);
    EXPECT_NEAR(answer.z[i] * g[i], 0.0, 1e-12);
  }
}

TEST(Frictionless, MeetsTheContactLawsToMachinePrecision) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const int m = 40;
    const Eigen::MatrixXd a = random_compliance(m, seed);
    ContactProblem problem = frictionless(a, random_vector(m, seed));
    problem.gap[3] = kInfinity;
    ContactMemory memory;
    expect_kkt(problem, solve_frictionless(problem, {}, memory));
  }
}

TEST(Frictionless, DoesNotDependOnItsStart) {
  const int m = 30;
  const Eigen::MatrixXd a = random_compliance(m, 77);
  const ContactProblem problem = frictionless(a, random_vector(m, 77));
  ContactMemory memory;
  const ContactAnswer cold = solve_frictionless(problem, {}, memory);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const ContactAnswer warm = solve_frictionless(problem, random_vector(m, seed + 100), memory);
    ASSERT_TRUE(warm.converged);
    EXPECT_LT((warm.z - cold.z).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Frictionless, MeetsAWantedForce) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const int m = 25;
    const Eigen::MatrixXd a = random_compliance(m, seed);
    ContactProblem problem = frictionless(a, random_vector(m, seed).cwiseAbs());
    problem.border = Eigen::VectorXd::Constant(m, 0.7);
    problem.force = Eigen::VectorXd::Constant(1, 0.3);
    ContactMemory memory;
    const ContactAnswer answer = solve_frictionless(problem, {}, memory);
    expect_kkt(problem, answer);
    EXPECT_NEAR(0.7 * answer.z.sum(), 0.3, 1e-13);
  }
}

TEST(Frictionless, WithoutOverlapNobodyCarries) {
  const Eigen::MatrixXd a = random_compliance(10, 5);
  const ContactProblem problem = frictionless(a, Eigen::VectorXd::Constant(10, 0.1));
  ContactMemory memory;
  const ContactAnswer answer = solve_frictionless(problem, {}, memory);
  ASSERT_TRUE(answer.converged);
  EXPECT_EQ(answer.z.cwiseAbs().maxCoeff(), 0.0);
}

TEST(Frictionless, ASystemThatIsntPositiveDefiniteHasNoAnswer) {
  const int m = 10;
  Eigen::MatrixXd a = random_compliance(m, 5);
  a(3, 3) = -a(3, 3);
  const ContactProblem problem = frictionless(a, Eigen::VectorXd::Constant(m, -0.1));
  ContactMemory memory;
  const ContactAnswer answer = solve_frictionless(problem, {}, memory);
  EXPECT_FALSE(answer.converged);
  EXPECT_EQ(answer.residual, kInfinity) << "not 0, which would say that the laws are met";
}

/// A patch of a half space in its vertices' own axes, pressed by a paraboloid and dragged along x.
struct Patch {
  Eigen::MatrixXd a;
  ContactProblem problem;
  explicit Patch(double friction, double drag) {
    const Compliance gel = test::half_space_gel(1.0, 0.2, {1.0, 0.4}, 5.0);
    const auto m = static_cast<Eigen::Index>(gel.vertices.size());
    a = gel.surface.view();
    const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      a.row(3 * i + 2) *= -1.0;
      a.col(3 * i + 2) *= -1.0;
      a.row(3 * i).swap(a.row(3 * i + 2));
      a.col(3 * i).swap(a.col(3 * i + 2));
    }
    problem.components = 3;
    problem.friction = Eigen::VectorXd::Constant(m, friction);
    problem.gap.resize(m);
    problem.drag = Eigen::VectorXd::Zero(2 * m);
    problem.border.resize(3 * m, 0);
    problem.force.resize(0);
    for (Eigen::Index i = 0; i < m; ++i) {
      problem.gap[i] = weight[i] * (0.5 * gel.vertices[i].squaredNorm() - 0.2);
      problem.drag[2 * i + 1] = weight[i] * drag;  // rows: normal, y, x
    }
  }
  ContactAnswer solve(double tolerance = 1e-12) {
    problem.compliance.emplace(a);
    ContactMemory memory;
    return solve_frictional(problem, {}, tolerance, memory);
  }
};

void expect_coulomb(const Patch& patch, const ContactAnswer& answer, double tolerance) {
  const Eigen::VectorXd slack = patch.a * answer.z;
  const double largest = answer.z.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < patch.problem.gap.size(); ++i) {
    const double p = answer.z[3 * i];
    const Eigen::Vector2d t = answer.z.segment<2>(3 * i + 1);
    const Eigen::Vector2d slip = slack.segment<2>(3 * i + 1) - patch.problem.drag.segment<2>(2 * i);
    const double stiffness = 1.0 / patch.a(3 * i, 3 * i);
    EXPECT_GE(p, -tolerance * largest);
    EXPECT_GE((patch.problem.gap[i] + slack[3 * i]) * stiffness, -tolerance * largest);
    EXPECT_LE(t.norm(), patch.problem.friction[i] * std::max(0.0, p) + tolerance * largest);
    if (answer.state[i] == NodeState::stick) {
      EXPECT_LT(slip.norm() * stiffness, tolerance * largest);
    }
    if (answer.state[i] == NodeState::slip) {
      EXPECT_NEAR(t.norm(), patch.problem.friction[i] * p, tolerance * largest);
      EXPECT_NEAR(t.dot(slip), -t.norm() * slip.norm(), tolerance * largest * slip.norm());  // friction opposes slip
    }
  }
}

TEST(Frictional, MeetsCoulombsLaw) {
  for (const double friction : {0.05, 0.3, 0.7, 1.5}) {
    for (const double drag : {0.0, 0.01, 0.05, 0.5}) {
      Patch patch(friction, drag);
      const ContactAnswer answer = patch.solve();
      ASSERT_TRUE(answer.converged) << friction << ' ' << drag << ' ' << answer.residual;
      expect_coulomb(patch, answer, 1e-9);
    }
  }
}

TEST(Frictional, VanishingFrictionIsNoFriction) {
  Patch patch(1e-12, 0.1);
  const ContactAnswer with = patch.solve();
  ASSERT_TRUE(with.converged);
  const auto m = patch.problem.gap.size();
  const auto normals = Eigen::seqN(Eigen::fix<0>, m, Eigen::fix<3>);
  const Eigen::MatrixXd a = patch.a(normals, normals);
  const ContactProblem problem = frictionless(a, patch.problem.gap);
  ContactMemory memory;
  const ContactAnswer without = solve_frictionless(problem, {}, memory);
  EXPECT_LT((with.z(normals) - without.z).cwiseAbs().maxCoeff(), 1e-10 * without.z.maxCoeff());
}

TEST(Frictional, InfiniteFrictionIsTheBondedLimitOfLargeFriction) {
  Patch bonded(kInfinity, 0.02);
  Patch rough(1e4, 0.02);
  const ContactAnswer a = bonded.solve();
  const ContactAnswer b = rough.solve();
  ASSERT_TRUE(a.converged);
  ASSERT_TRUE(b.converged);
  EXPECT_LT((a.z - b.z).norm(), 1e-2 * a.z.norm());
  for (const NodeState s : a.state) EXPECT_NE(s, NodeState::slip);
}

TEST(Frictional, AStartThatLetsGoAtOnceIsNoObstacle) {
  // By force, from tractions on vertices that the body has left: once they are open nothing moves what begins to touch,
  // so that it has no direction to slide in.
  Patch patch(0.5, 0.0);
  const auto m = patch.problem.gap.size();
  patch.problem.border = Eigen::MatrixXd::Zero(3 * m, 1);
  for (Eigen::Index i = 0; i < m; ++i) patch.problem.border(3 * i, 0) = 0.03;
  patch.problem.force = Eigen::VectorXd::Constant(1, 0.02);
  patch.problem.compliance.emplace(patch.a);
  ContactMemory none;
  const ContactAnswer wanted = solve_frictional(patch.problem, {}, 1e-12, none);
  ASSERT_TRUE(wanted.converged);
  Eigen::VectorXd start = Eigen::VectorXd::Zero(3 * m);
  for (Eigen::Index i = 0; i < m; ++i) {
    if (patch.problem.gap[i] > 0.0) start[3 * i] = 1e-3;
  }
  ContactMemory memory;
  const ContactAnswer answer = solve_frictional(patch.problem, start, 1e-12, memory);
  ASSERT_TRUE(answer.converged) << answer.residual;
  EXPECT_LT((answer.z - wanted.z).norm(), 1e-8 * wanted.z.norm());
}

TEST(Frictional, AMirroredDragGivesTheMirroredTraction) {
  Patch plus(0.4, 0.03);
  Patch minus(0.4, -0.03);
  const ContactAnswer a = plus.solve();
  const ContactAnswer b = minus.solve();
  ASSERT_TRUE(a.converged && b.converged);
  const auto xs = Eigen::seqN(2, plus.problem.gap.size(), Eigen::fix<3>);
  EXPECT_NEAR(a.z(xs).sum(), -b.z(xs).sum(), 1e-9 * std::abs(a.z(xs).sum()));
}

}  // namespace
}  // namespace touchstone::fem
