#pragma once
// Linear elasticity by Taylor-Hood tetrahedra: displacement quadratic (vertices and middles of edges), pressure linear
// and continuous (vertices). Find u, p with
//   int 2 G eps(u):eps(v) - int p div v = int f.v + int t.v,     -int q div u - int p q / lambda = 0
// ([Hughes1987, sec. 4.3]; [Taylor1973]). Solved without units: lengths over `length`, stresses over `stress`; p =
// -lambda div u, stress = 2 G eps - p I. The pressure is scaled once more, by each region's `pressure_scale`, so that
// nu = 0 (lambda = 0) needs no special case.
//
// G and lambda are constant in each region of the mesh. Where regions of different materials meet, the pressure jumps
// (the normal stress doesn't): a vertex there has a pressure of its own in each of them, without which the order of
// convergence would be lost.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "fem/elements/elastic_material.h"
#include "fem/elements/schur_solver.h"
#include "fem/mesh/tet_mesh.h"

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
  /// Pressures: 0..vertices-1 are the vertices', the rest the further ones of vertices between materials.
  std::vector<std::array<int, 4>> element_pressures;  ///< pressures at each tetrahedron's corners
  std::vector<int> pressure_vertex;                   ///< per pressure: its vertex
  std::vector<int> pressure;                          ///< per pressure: its unknown
  int unknowns = 0;

  /// mm
  Eigen::Vector3d position(int node) const;
  /// Node in the middle of the edge between two vertices. The edge must exist.
  int middle(int a, int b) const;
};

/// The pressure may jump between any two regions. @throws Error naming the fault of the mesh (fault_of)
TaylorHoodSpace make_space(const TetMesh& mesh);
/// The pressure may jump between regions whose materials (one a region) differ; so layers that are alike are one body.
TaylorHoodSpace make_space(const TetMesh& mesh, std::span<const ElasticMaterial> materials);

/// The scales that take units away.
struct Scales {
  /// The material of one region, without units.
  struct Region {
    double shear = 1.0;            ///< G / stress
    double pressure_scale = 1.0;   ///< p = stress * pressure_scale * (pressure unknown)
    double compressibility = 0.0;  ///< factor of the pressure's mass matrix, stress pressure_scale^2 / lambda
  };
  double length = 1.0;  ///< mm: cube root of the gel's volume
  double stress = 1.0;  ///< MPa: G; of several materials the mean of its logarithm over the volume
  std::vector<Region> regions;
};
/// @throws Error for a bad material, or fewer materials than the mesh has regions
Scales make_scales(const TetMesh& mesh, std::span<const ElasticMaterial> materials);
Scales make_scales(const TetMesh& mesh, const ElasticMaterial& material);  ///< the same in all regions

/// The system matrix over the space's unknowns, without units; symmetric quasi-definite. Element blocks are added in
/// the elements' order whatever the number of threads.
SymmetricEntries assemble(const TaylorHoodSpace& space, const Scales& scales);

/// One element's coupling of a node (rows: displacement 0..2, pressure 3) with its ten nodes (columns likewise).
using ElementRow = std::array<Eigen::Matrix4d, 10>;

/// Adds up a symmetric matrix over the space's unknowns from the elements' rows. `row_of(element, node, wanted)` is
/// called from several threads; only its wanted blocks are used. In the elements' order whatever the number of threads.
SymmetricEntries assemble_rows(
    const TaylorHoodSpace& space,
    const std::function<ElementRow(int element, int node, const std::array<bool, 10>& wanted)>& row_of);

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

/// Displacement and pressure at the nodes of the space.
struct ElasticSolution {
  Eigen::MatrixX3d displacement;  ///< nodes x 3, mm
  Eigen::VectorXd pressure;       ///< per pressure of the space (the first ones: vertices), MPa
};

/// Solves one load case, with one material a region or one for all. @throws Error for a bad mesh or material
ElasticSolution solve_elastic(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials,
                              const ElasticLoads& loads);
ElasticSolution solve_elastic(const TaylorHoodSpace& space, const ElasticMaterial& material, const ElasticLoads& loads);

/// In one tetrahedron, at barycentric coordinates.
Eigen::Vector3d displacement_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                                const Eigen::Vector4d& barycentric);
/// The pressure there, MPa.
double pressure_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                   const Eigen::Vector4d& barycentric);
/// Row a, column b: d u_a / d x_b.
Eigen::Matrix3d displacement_gradient_at(const TaylorHoodSpace& space, const ElasticSolution& solution, int element,
                                         const Eigen::Vector4d& barycentric);
/// Stress 2 G eps - p I, MPa; `material` is the element's.
Eigen::Matrix3d stress_at(const TaylorHoodSpace& space, const ElasticMaterial& material,
                          const ElasticSolution& solution, int element, const Eigen::Vector4d& barycentric);

}  // namespace touchstone::fem
