#include "fem/finite_strain/finite_strain.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "fem/elements/quadrature.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kYoung = 0.33;

/// A homogeneous state: F, and p where the material leaves it free.
struct Homogeneous {
  Matrix3d gradient;
  double pressure = 0.0;  // MPa
};

/// p of the material at this F, and at nu = 0.5 any. From 0.49 on the volume is kept: a dilated block under the dead
/// loads that it needs (several G) isn't stable.
Homogeneous large_state(double nu, Matrix3d gradient) {
  if (nu > 0.48) gradient /= std::cbrt(gradient.determinant());
  if (nu > 0.4999) return {gradient, 0.04};
  const ElasticMaterial material{kYoung, nu};
  return {gradient, -shear_modulus(material) * lame_ratio(material) * (gradient.determinant() - 1.0)};
}

Matrix3d nominal_stress(double nu, const Homogeneous& state) {
  const double shear = shear_modulus({kYoung, nu});
  const Matrix3d inverse = state.gradient.inverse().transpose();
  return shear * (state.gradient - inverse) - state.pressure * state.gradient.determinant() * inverse;
}

double largest_error(const TaylorHoodSpace& space, const ElasticSolution& solution, const Matrix3d& gradient) {
  double error = 0.0;
  for (int node = 0; node < space.nodes; ++node) {
    const Vector3d exact = (gradient - Matrix3d::Identity()) * space.position(node);
    error = std::max(error, (solution.displacement.row(node).transpose() - exact).norm());
  }
  return error;
}

TEST(FiniteStrain, PatchTestAtLargeDeformation) {
  TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 3, 2, 2, 0.15);
  // Held all round but for the top: with its sides free too, a block under dead loads buckles before.
  mesh.bonded.clear();
  for (const auto& face : boundary_faces(mesh)) {
    if (std::find(mesh.outer.begin(), mesh.outer.end(), face) == mesh.outer.end()) mesh.bonded.push_back(face);
  }
  const TaylorHoodSpace space = make_space(mesh);
  Matrix3d gradient;
  gradient << 1.20, -0.30, 0.15, 0.13, 0.80, 0.27, -0.18, 0.06, 1.11;
  Matrix3d stretch = Vector3d(1.5, 1.2, 0.6).asDiagonal();
  Matrix3d shear = Matrix3d::Identity();
  shear(0, 2) = 0.3;
  for (const double nu : {0.0, 0.3, 0.49, 0.5}) {
    for (const Matrix3d& wanted : {gradient, stretch, shear}) {
      const Homogeneous exact = large_state(nu, wanted);
      const Matrix3d nominal = nominal_stress(nu, exact);
      ElasticLoads loads;
      loads.bonded_displacement = [&](const Vector3d& x) -> Vector3d {
        return (exact.gradient - Matrix3d::Identity()) * x;
      };
      loads.traction = [&](const Vector3d&, const Vector3d& normal) -> Vector3d { return nominal * normal; };
      // The exact state is in equilibrium, whichever other states are too.
      const FiniteStrain problem(space, {kYoung, nu});
      ElasticSolution homogeneous = problem.at_rest();
      for (int node = 0; node < space.nodes; ++node) {
        homogeneous.displacement.row(node) = loads.bonded_displacement(space.position(node)).transpose();
      }
      homogeneous.pressure.setConstant(exact.pressure);
      const Eigen::VectorXd out_of_balance =
          problem.residual(homogeneous).values - load_vector(space, problem.scales(), loads);
      EXPECT_LT(out_of_balance.norm(), nu > 0.4999 ? 1e-7 : 1e-13);
      if (wanted == gradient) continue;  // Newton's method may find it buckled
      const ElasticSolution solution = solve_finite_strain(space, {kYoung, nu}, loads);
      // 0.5 is solved as 0.5 - 1e-8, where p makes a little volume.
      EXPECT_LT(largest_error(space, solution, exact.gradient), nu > 0.4999 ? 3e-8 : 1e-9) << nu;
      for (int v = 0; v < space.vertices && nu > 0.0; ++v) {
        EXPECT_NEAR(solution.pressure[v], exact.pressure, nu > 0.4999 ? 1e-7 : 1e-8) << nu;
      }
    }
  }
}

TEST(FiniteStrain, RigidMotionCausesNoForce) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 2, 2, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  const FiniteStrain problem(space, {kYoung, 0.5});
  const Matrix3d turn = Eigen::AngleAxisd(2.0, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  ElasticSolution state = problem.at_rest();
  for (int node = 0; node < space.nodes; ++node) {
    state.displacement.row(node) = (turn * space.position(node) + Vector3d(4, 5, 6) - space.position(node)).transpose();
  }
  EXPECT_LT(problem.residual(state).values.norm(), 1e-13);
  EXPECT_NEAR(problem.stored_energy(state), 0.0, 1e-13);
  EXPECT_NEAR(problem.smallest_volume_ratio(state), 1.0, 1e-12);
}

/// Some smooth state far from rest.
ElasticSolution some_state(const FiniteStrain& problem) {
  const TaylorHoodSpace& space = problem.space();
  ElasticSolution state = problem.at_rest();
  for (int node = 0; node < space.nodes; ++node) {
    const Vector3d x = space.position(node);
    state.displacement.row(node) << 0.2 * std::sin(x.y() + x.z()), 0.1 * x.x() * x.z(), 0.15 * std::cos(x.x());
  }
  for (int v = 0; v < space.vertices; ++v) {
    state.pressure[v] = 0.03 * std::sin(3.0 * v);
  }
  return state;
}

TEST(FiniteStrain, ResidualIsTheEnergysDerivativeAndTangentTheResiduals) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 2, 2, 1, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  for (const double nu : {0.2, 0.5}) {
    const FiniteStrain problem(space, {kYoung, nu});
    const ElasticSolution state = some_state(problem);
    ASSERT_GT(problem.smallest_volume_ratio(state), 0.2);
    Eigen::VectorXd direction(space.unknowns);
    for (int k = 0; k < space.unknowns; ++k) {
      direction[k] = std::sin(1.0 + 7.3 * k);
    }
    constexpr double kStep = 1e-5;
    const ElasticSolution up = problem.moved(state, direction, kStep);
    const ElasticSolution down = problem.moved(state, direction, -kStep);
    const Eigen::VectorXd residual = problem.residual(state).values;
    const Scales& scales = problem.scales();
    const double slope = (problem.stored_energy(up) - problem.stored_energy(down)) / (2 * kStep) /
                         (scales.stress * std::pow(scales.length, 3));
    EXPECT_NEAR(residual.dot(direction), slope, 1e-6 * (1.0 + std::abs(slope)));
    const Eigen::VectorXd change = (problem.residual(up).values - problem.residual(down).values) / (2 * kStep);
    const SymmetricEntries tangent = problem.tangent(state);
    Eigen::VectorXd product = Eigen::VectorXd::Zero(space.unknowns);
    for (std::size_t k = 0; k < tangent.values.size(); ++k) {
      product[tangent.rows[k]] += tangent.values[k] * direction[tangent.columns[k]];
      if (tangent.rows[k] != tangent.columns[k]) {
        product[tangent.columns[k]] += tangent.values[k] * direction[tangent.rows[k]];
      }
    }
    EXPECT_LT((product - change).norm(), 1e-7 * change.norm()) << nu;
    // The clamped nodes' columns likewise.
    Eigen::MatrixX3d clamped_change = Eigen::MatrixX3d::Zero(space.nodes, 3);
    for (int node = 0; node < space.nodes; ++node) {
      if (space.clamped[node]) clamped_change.row(node) << std::sin(node), std::cos(node), 0.3;
    }
    ElasticSolution after = state;
    ElasticSolution before = state;
    after.displacement += kStep * clamped_change;
    before.displacement -= kStep * clamped_change;
    const Eigen::VectorXd pulled = (problem.residual(after).values - problem.residual(before).values) / (2 * kStep);
    EXPECT_LT((problem.clamped_pull(state, clamped_change) - pulled).norm(), 1e-7 * pulled.norm());
  }
}

/// The tangent at rest is the linear system: the same entries, but for the rules' rounding.
TEST(FiniteStrain, TangentAtRestIsTheLinearSystem) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1.5}, 2, 2, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  for (const double nu : {0.0, 0.3, 0.5}) {
    const FiniteStrain problem(space, {kYoung, nu});
    const SymmetricEntries found = problem.tangent(problem.at_rest());
    const SymmetricEntries linear = assemble(space, problem.scales());
    std::map<std::pair<int, int>, double> difference;
    for (std::size_t k = 0; k < linear.values.size(); ++k)
      difference[{linear.rows[k], linear.columns[k]}] += linear.values[k];
    for (std::size_t k = 0; k < found.values.size(); ++k)
      difference[{found.rows[k], found.columns[k]}] -= found.values[k];
    for (const auto& [place, value] : difference) {
      EXPECT_NEAR(value, 0.0, 1e-14);
    }
  }
}

ElasticLoads patch_of_traction(double size) {
  ElasticLoads loads;
  loads.traction = [size](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    const bool under = normal.z() > 0.9 && std::abs(x.x()) < 0.5 && std::abs(x.y()) < 0.5;
    return under ? Vector3d(0.2 * size, 0.0, -size) : Vector3d::Zero();
  };
  return loads;
}

TEST(FiniteStrain, EqualsLinearElasticityForSmallLoads) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 6, 6, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  double before = 0.0;
  for (const double load : {1e-2, 1e-3, 1e-4}) {
    const Eigen::MatrixX3d linear = solve_elastic(space, {kYoung, 0.5}, patch_of_traction(load)).displacement;
    const Eigen::MatrixX3d finite = solve_finite_strain(space, {kYoung, 0.5}, patch_of_traction(load)).displacement;
    const double difference = (finite - linear).norm() / linear.norm();
    if (before > 0.0) {
      EXPECT_NEAR(before / difference, 10.0, 1.5);  // of first order in the load
    }
    before = difference;
  }
  EXPECT_LT(before, 1e-3);
}

TEST(FiniteStrain, NewtonConvergesQuadratically) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 6, 6, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  FiniteStrainEffort effort;
  solve_finite_strain(space, {kYoung, 0.5}, patch_of_traction(0.15), &effort);
  EXPECT_EQ(effort.steps, 1);
  const auto& r = effort.residuals;
  ASSERT_GE(r.size(), 4u);
  EXPECT_LE(r.size(), 9u);
  // Each residual is of the order of the last one's square, until rounding.
  int seen = 0;
  for (std::size_t k = 1; k + 1 < r.size(); ++k) {
    if (r[k] < 1e-2 && r[k] > 1e-7) {
      EXPECT_LT(r[k + 1], 30.0 * r[k] * r[k]) << k;
      ++seen;
    }
  }
  EXPECT_GE(seen, 1);
}

/// The work of a slowly growing dead load is the energy stored (trapezoidal rule, second order in the step).
TEST(FiniteStrain, WorkOfTheLoadIsTheStoredEnergy) {
  const TetMesh mesh = fixtures::box_mesh({3, 3, 1}, 4, 4, 2, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticMaterial material{kYoung, 0.49};
  const FiniteStrain problem(space, material);
  const ElasticLoads whole = patch_of_traction(0.1);
  const Eigen::VectorXd load = load_vector(space, problem.scales(), whole);
  const auto along = [&](const ElasticSolution& state) {  // load . u, N mm
    double sum = 0.0;
    for (int node = 0; node < space.nodes; ++node) {
      if (!space.clamped[node]) sum += load.segment<3>(space.displacement[node]).dot(state.displacement.row(node));
    }
    return sum * problem.scales().stress * std::pow(problem.scales().length, 2);
  };
  double work = 0.0;
  double before = 0.0;
  ElasticSolution state;
  constexpr int kSteps = 8;
  for (int k = 1; k <= kSteps; ++k) {
    state = solve_finite_strain(space, material, patch_of_traction(0.1 * k / kSteps));
    const double now = along(state);
    work += (now - before) * (k - 0.5) / kSteps;
    before = now;
  }
  EXPECT_NEAR(work, problem.stored_energy(state), 1e-3 * work);
  EXPECT_GT(std::abs(0.5 * before - work),
            5e-3 * work);  // it isn't linear here: half load times displacement would be wrong
}

/// A block between lubricated plates, incompressible: force per undeformed area G (l - 1/l^2).
TEST(FiniteStrain, ALubricatedBlockHasItsClosedForm) {
  const TetMesh mesh = fixtures::box_mesh({2, 2, 1.5}, 2, 2, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticMaterial material{kYoung, 0.5};
  for (const double stretch : {0.6, 0.8, 1.4}) {
    const double nominal = shear_modulus(material) * (stretch - 1.0 / (stretch * stretch));
    ElasticLoads loads;
    loads.traction = [&](const Vector3d&, const Vector3d& normal) -> Vector3d {
      return normal.z() > 0.9 ? Vector3d(0, 0, nominal) : Vector3d::Zero();
    };
    const double side = 1.0 / std::sqrt(stretch) - 1.0;
    loads.bonded_displacement = [&](const Vector3d& x) -> Vector3d { return {side * x.x(), side * x.y(), 0.0}; };
    const ElasticSolution solution = solve_finite_strain(space, material, loads);
    for (int node = 0; node < space.nodes; ++node) {
      const double height = space.position(node).z() + 1.5;
      EXPECT_NEAR(solution.displacement(node, 2), (stretch - 1.0) * height, 1e-7) << stretch;
    }
  }
}

/// A bent and stretched block with the body force that it needs, as the mesh becomes finer: third order in u's L2 norm,
/// second in p's.
double manufactured_error(int cells, double& pressure_error) {
  const TetMesh mesh = fixtures::box_mesh({1, 1, 1}, cells, cells, cells, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  const ElasticMaterial material{kYoung, 0.4};
  const double shear = shear_modulus(material);
  const double lame = shear * lame_ratio(material);
  const auto displacement = [](const Vector3d& x) -> Vector3d {
    return {0.15 * std::sin(2.0 * x.y() + x.z()), 0.1 * std::sin(2.0 * x.z()), 0.12 * std::cos(2.0 * x.x())};
  };
  const auto gradient = [](const Vector3d& x) {
    Matrix3d f = Matrix3d::Identity();
    f(0, 1) = 0.3 * std::cos(2.0 * x.y() + x.z());
    f(0, 2) = 0.15 * std::cos(2.0 * x.y() + x.z());
    f(1, 2) = 0.2 * std::cos(2.0 * x.z());
    f(2, 0) = -0.24 * std::sin(2.0 * x.x());
    return f;
  };
  const auto nominal = [&](const Vector3d& x) -> Matrix3d {
    const Matrix3d f = gradient(x);
    const double j = f.determinant();
    return shear * f + (lame * (j - 1.0) * j - shear) * f.inverse().transpose();
  };
  ElasticLoads loads;
  loads.bonded_displacement = displacement;
  loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d { return nominal(x) * normal; };
  loads.body_force = [&](const Vector3d& x) -> Vector3d {
    constexpr double kStep = 1e-4;
    Vector3d force = Vector3d::Zero();
    for (int a = 0; a < 3; ++a) {
      const Vector3d step = kStep * Vector3d::Unit(a);
      force -= (nominal(x + step) - nominal(x - step)).col(a) / (2.0 * kStep);
    }
    return force;
  };
  const ElasticSolution solution = solve_finite_strain(space, material, loads);
  double square = 0.0;
  double pressure_square = 0.0;
  for (std::size_t e = 0; e < space.elements.size(); ++e) {
    const double size = volume(mesh, mesh.tetrahedra[e]);
    for (const auto& point : tetrahedron_rule(6)) {
      Vector3d x = Vector3d::Zero();
      for (int k = 0; k < 4; ++k) x += point.barycentric[k] * mesh.vertices[mesh.tetrahedra[e][k]];
      const int element = static_cast<int>(e);
      square += size * point.weight *
                (displacement_at(space, solution, element, point.barycentric) - displacement(x)).squaredNorm();
      const double p = -lame * (gradient(x).determinant() - 1.0);
      pressure_square +=
          size * point.weight * std::pow(pressure_at(space, solution, element, point.barycentric) - p, 2);
    }
  }
  pressure_error = std::sqrt(pressure_square);
  return std::sqrt(square);
}

TEST(FiniteStrain, ManufacturedSolutionConvergesAtTheElementsOrder) {
  double coarse_pressure = 0.0;
  double fine_pressure = 0.0;
  const double coarse = manufactured_error(3, coarse_pressure);
  const double fine = manufactured_error(6, fine_pressure);
  EXPECT_GT(std::log2(coarse / fine), 2.6);
  EXPECT_GT(std::log2(coarse_pressure / fine_pressure), 1.6);
}

TEST(FiniteStrain, AnImpossibleLoadEndsInAClearError) {
  const TetMesh mesh = fixtures::box_mesh({2, 2, 1}, 2, 2, 1, 0.1);
  const TaylorHoodSpace space = make_space(mesh);
  ElasticLoads loads;
  loads.bonded_displacement = [](const Vector3d& x) -> Vector3d { return {-1.5 * x.x(), 0.0, 0.0}; };  // mirrored
  try {
    solve_finite_strain(space, {kYoung, 0.49}, loads);
    FAIL() << "it can't be solved";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("the finite-strain solution ends at"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace touchstone::fem
