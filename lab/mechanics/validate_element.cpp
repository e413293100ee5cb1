// The element by itself: what it must represent exactly, and how fast it converges.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "fem/elements/quadrature.h"
#include "fem/elements/taylor_hood.h"
#include "lab/validation/mechanics_rows.h"

namespace touchstone::lab {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A cube of 2 mm below z = 0, bonded at its bottom, as cells^3 boxes of six tetrahedra each (Kuhn), inner vertices
/// pushed aside so that nothing is right by symmetry.
fem::TetMesh uneven_cube(int cells) {
  fem::TetMesh mesh;
  const auto index = [cells](int i, int j, int k) { return (k * (cells + 1) + j) * (cells + 1) + i; };
  for (int k = 0; k <= cells; ++k) {
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        const std::array<int, 3> corner = {i, j, k};
        Vector3d x;
        for (int a = 0; a < 3; ++a) {
          const bool inner = corner[a] > 0 && corner[a] < cells;
          const double push = inner ? 0.1 * std::sin(7.0 * i + 3.0 * j + 5.0 * k + 2.0 * a) : 0.0;
          x[a] = 2.0 * (corner[a] + push) / cells - (a == 2 ? 2.0 : 1.0);
        }
        mesh.vertices.push_back(x);
      }
    }
  }
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int k = 0; k < cells; ++k) {
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        for (const auto& order : kOrders) {
          std::array<int, 3> corner = {i, j, k};
          std::array<int, 4> tetrahedron = {index(i, j, k), 0, 0, 0};
          for (int step = 0; step < 3; ++step) {
            ++corner[order[step]];
            tetrahedron[step + 1] = index(corner[0], corner[1], corner[2]);
          }
          if (fem::volume(mesh, tetrahedron) < 0.0) std::swap(tetrahedron[2], tetrahedron[3]);
          mesh.tetrahedra.push_back(tetrahedron);
        }
      }
    }
  }
  for (const auto& face : fem::boundary_faces(mesh)) {
    const auto level = [&](double z) {
      return std::all_of(face.begin(), face.end(), [&](int v) { return std::abs(mesh.vertices[v].z() - z) < 1e-12; });
    };
    if (level(0.0)) mesh.outer.push_back(face);
    if (level(-2.0)) mesh.bonded.push_back(face);
  }
  return mesh;
}

/// A field without change of volume, u = (sin y e^z, cos z sin x, 0), with the pressure G sin(x + 2 y) cos z, at
/// nu = 0.5: what is left on a mesh in L2.
struct FieldErrors {
  double displacement = 0.0, pressure = 0.0;
};

FieldErrors manufactured(int cells) {
  const fem::ElasticMaterial material{kValidationModulus, 0.5};
  const double shear = fem::shear_modulus(material);
  const auto displacement = [](const Vector3d& x) -> Vector3d {
    return {std::sin(x.y()) * std::exp(x.z()), std::cos(x.z()) * std::sin(x.x()), 0.0};
  };
  const auto pressure = [shear](const Vector3d& x) { return shear * std::sin(x.x() + 2.0 * x.y()) * std::cos(x.z()); };
  const fem::TetMesh mesh = uneven_cube(cells);
  const fem::TaylorHoodSpace space = fem::make_space(mesh);
  fem::ElasticLoads loads;
  loads.bonded_displacement = displacement;
  loads.body_force = [shear](const Vector3d& x) -> Vector3d {                    // -G laplace u + grad p
    const Vector3d laplace(0.0, -2.0 * std::cos(x.z()) * std::sin(x.x()), 0.0);  // sin y e^z is harmonic
    const double c = std::cos(x.x() + 2.0 * x.y());
    const double s = std::sin(x.x() + 2.0 * x.y());
    return -shear * laplace + shear * Vector3d(c * std::cos(x.z()), 2.0 * c * std::cos(x.z()), -s * std::sin(x.z()));
  };
  loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    Matrix3d g = Matrix3d::Zero();
    g(0, 1) = std::cos(x.y()) * std::exp(x.z());
    g(0, 2) = std::sin(x.y()) * std::exp(x.z());
    g(1, 0) = std::cos(x.z()) * std::cos(x.x());
    g(1, 2) = -std::sin(x.z()) * std::sin(x.x());
    return shear * (g + g.transpose()) * normal - pressure(x) * normal;
  };
  const fem::ElasticSolution solution = fem::solve_elastic(space, material, loads);
  FieldErrors errors;
  for (int e = 0; e < static_cast<int>(mesh.tetrahedra.size()); ++e) {
    const double size = fem::volume(mesh, mesh.tetrahedra[e]);
    for (const auto& point : fem::tetrahedron_rule(6)) {
      Vector3d x = Vector3d::Zero();
      for (int k = 0; k < 4; ++k) x += point.barycentric[k] * mesh.vertices[mesh.tetrahedra[e][k]];
      errors.displacement +=
          point.weight * size *
          (fem::displacement_at(space, solution, e, point.barycentric) - displacement(x)).squaredNorm();
      errors.pressure +=
          point.weight * size * std::pow(fem::pressure_at(space, solution, e, point.barycentric) - pressure(x), 2);
    }
  }
  return {std::sqrt(errors.displacement), std::sqrt(errors.pressure)};
}

/// Largest nodal error of a linear field over its size, and of a rigid motion's stress over E: both must be nothing.
MechanicsFinding patch(const MechanicsGels&) {
  const fem::TetMesh mesh = uneven_cube(3);
  const fem::TaylorHoodSpace space = fem::make_space(mesh);
  Matrix3d gradient;
  gradient << 0.010, -0.020, 0.005, 0.013, -0.004, 0.017, -0.008, 0.006, 0.011;
  double worst = 0.0;
  for (double nu : {0.0, 0.3, 0.49, 0.4999}) {
    const fem::ElasticMaterial material{kValidationModulus, nu};
    const double shear = fem::shear_modulus(material);
    const Matrix3d stress = shear * (gradient + gradient.transpose()) +
                            shear * fem::lame_ratio(material) * gradient.trace() * Matrix3d::Identity();
    fem::ElasticLoads loads;
    loads.bonded_displacement = [&](const Vector3d& x) -> Vector3d { return gradient * x; };
    loads.traction = [&](const Vector3d&, const Vector3d& normal) -> Vector3d { return stress * normal; };
    const fem::ElasticSolution solution = fem::solve_elastic(space, material, loads);
    for (int node = 0; node < space.nodes; ++node) {
      const Vector3d error = solution.displacement.row(node).transpose() - gradient * space.position(node);
      worst = std::max(worst, error.cwiseAbs().maxCoeff() / gradient.norm());
    }
  }
  return {worst, {}};
}

MechanicsFinding rigid_motion(const MechanicsGels&) {
  const fem::TetMesh mesh = uneven_cube(3);
  const fem::TaylorHoodSpace space = fem::make_space(mesh);
  double worst = 0.0;
  for (double nu : {0.0, 0.3, 0.5}) {
    const fem::ElasticMaterial material{kValidationModulus, nu};
    const Vector3d spin(0.02, -0.03, 0.05);
    fem::ElasticLoads loads;
    loads.bonded_displacement = [&](const Vector3d& x) -> Vector3d { return Vector3d(1, 2, -1) + spin.cross(x); };
    const fem::ElasticSolution solution = fem::solve_elastic(space, material, loads);
    for (int e = 0; e < static_cast<int>(mesh.tetrahedra.size()); ++e) {
      const Matrix3d stress = fem::stress_at(space, material, solution, e, Eigen::Vector4d::Constant(0.25));
      worst = std::max(worst, stress.cwiseAbs().maxCoeff() / kValidationModulus);
    }
  }
  return {worst, {}};
}

using ErrorOf = double FieldErrors::*;

/// The order in which an error falls on the last halving of the cells, and the error on all meshes.
MechanicsFinding order_of(ErrorOf error, const std::vector<int>& cells) {
  MechanicsFinding finding;
  finding.series = ValidationSeries{"edge of the mesh, mm", "error in L2", {}};
  std::vector<double> errors;
  for (const int count : cells) {
    errors.push_back(manufactured(count).*error);
    finding.series->points.emplace_back(2.0 / count, errors.back());
  }
  const std::size_t last = errors.size() - 1;
  finding.ours = std::log(errors[last - 1] / errors[last]) /
                 std::log(static_cast<double>(cells[last]) / static_cast<double>(cells[last - 1]));
  return finding;
}

}  // namespace

std::vector<MechanicsCase> element_cases(bool quick) {
  // Theory: third order in displacement, second in pressure [Boffi2013, sec. 8.8].
  const std::vector<int> cells = quick ? std::vector<int>{4, 8} : std::vector<int>{3, 6, 12};
  return {
      {"mechanics.patch", "a linear field is exact, nu to 0.4999", 0.0, Better::lower, 1e-9, patch},
      {"mechanics.rigid_motion", "a rigid motion's stress over E", 0.0, Better::lower, 1e-11, rigid_motion},
      {"mechanics.order_displacement", "order of the displacement's error in L2 at nu = 0.5", 3.0, Better::higher, 2.7,
       [cells](const MechanicsGels&) { return order_of(&FieldErrors::displacement, cells); }},
      {"mechanics.order_pressure", "order of the pressure's error in L2 at nu = 0.5", 2.0, Better::higher, 1.8,
       [cells](const MechanicsGels&) { return order_of(&FieldErrors::pressure, cells); }},
  };
}

}  // namespace touchstone::lab
