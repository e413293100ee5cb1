#pragma once
// Linear elasticity by Taylor-Hood tetrahedra: displacement quadratic (vertices and middles of edges), pressure linear
// and continuous (vertices). Find u, p with
//   int 2 eps(u):eps(v) - int p div v = int f.v + int t.v,     -int q div u - int p q G / lambda = 0
// (Hughes, The Finite Element Method, sec. 4.3; Taylor and Hood, Computers and Fluids 1, 1973). Solved without units:
// lengths over `length`, stresses over G; p = -lambda div u, stress = 2 G eps - p I. The pressure is scaled once more,
// by `pressure_scale`, so that nu = 0 (lambda = 0) needs no special case.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "fem/elastic_material.h"
#include "fem/schur_solver.h"
#include "fem/tet_mesh.h"

namespace touchstone::fem {

/// Values of the ten quadratic shape functions: corners 0..3, then edges 01, 02, 03, 12, 13, 23.
Eigen::Matrix<double, 10, 1> quadratic_shape(const Eigen::Vector4d& barycentric);

/// The two corners of each edge, in the order of the shape functions.
inline constexpr std::array<std::array<int, 2>, 6> kTetEdges = {{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// Gradients (columns) of the ten quadratic shape functions of a tetrahedron with these corners (1/mm).
Eigen::Matrix<double, 3, 10> quadratic_gradients(const std::array<Eigen::Vector3d, 4>& corners,
                                                 const Eigen::Vector4d& barycentric);

/// Numbering of nodes and unknowns on a mesh, which must outlive it.
struct TaylorHoodSpace {
  const TetMesh* mesh = nullptr;
  int vertices = 0;  ///< nodes 0..vertices-1 are the mesh's vertices, the rest middles of edges
  int nodes = 0;
  std::vector<std::array<int, 10>> elements;  ///< nodes of each tetrahedron
  std::vector<std::array<int, 2>> edges;      ///< ends of the edge under node `vertices + k`, lower first
  std::vector<char> clamped;                  ///< per node: its displacement is given
  std::vector<int> displacement;              ///< per node: its first of three unknowns, -1 if clamped
  std::vector<int> pressure;                  ///< per vertex: its unknown
  int unknowns = 0;

  /// mm
  Eigen::Vector3d position(int node) const;
  /// Node in the middle of the edge between two vertices. The edge must exist.
  int middle(int a, int b) const;
};

/// @throws Error naming the fault of the mesh (fault_of)
TaylorHoodSpace make_space(const TetMesh& mesh);

/// The scales that take units away.
struct Scales {
  double length = 1.0;           ///< mm: cube root of the gel's volume
  double stress = 1.0;           ///< MPa: G
  double pressure_scale = 1.0;   ///< p = stress * pressure_scale * (pressure unknown)
  double compressibility = 0.0;  ///< factor of the pressure's mass matrix, G pressure_scale^2 / lambda
};
Scales make_scales(const TetMesh& mesh, const ElasticMaterial& material);

/// The system matrix over the space's unknowns, without units; symmetric quasi-definite. Element blocks are added in
/// the elements' order whatever the number of threads.
SymmetricEntries assemble(const TaylorHoodSpace& space, const Scales& scales);

/// What drives a problem. Each is optional.
struct ElasticLoads {
  std::function<Eigen::Vector3d(const Eigen::Vector3d& x)> body_force;  ///< N/mm^3
  /// On every face that isn't bonded; `normal` is out. MPa
  std::function<Eigen::Vector3d(const Eigen::Vector3d& x, const Eigen::Vector3d& normal)> traction;
  std::function<Eigen::Vector3d(const Eigen::Vector3d& x)> bonded_displacement;  ///< mm
};

/// Right-hand side over the space's unknowns, without units, of the loads on the body and its free faces; what is
/// given at the bonded faces isn't in it.
Eigen::VectorXd load_vector(const TaylorHoodSpace& space, const Scales& scales, const ElasticLoads& loads);

struct ElasticSolution {
  Eigen::MatrixX3d displacement;  ///< nodes x 3, mm
  Eigen::VectorXd pressure;       ///< vertices, MPa
};

/// Solves one load case. @throws Error for a bad mesh or material
ElasticSolution solve_elastic(const TaylorHoodSpace& space, const ElasticMaterial& material, const ElasticLoads& loads);

/// In one tetrahedron, at barycentric coordinates.
Eigen::Vector3d displacement_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                                const Eigen::Vector4d& barycentric);
double pressure_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                   const Eigen::Vector4d& barycentric);
/// Row a, column b: d u_a / d x_b.
Eigen::Matrix3d displacement_gradient_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                                         const Eigen::Vector4d& barycentric);
/// Stress 2 G eps - p I, MPa.
Eigen::Matrix3d stress_at(const TaylorHoodSpace& space, const ElasticMaterial& material,
                          const ElasticSolution& solution, int element, const Eigen::Vector4d& barycentric);

}  // namespace touchstone::fem
