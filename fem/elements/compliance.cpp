#include "fem/elements/compliance.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/memory_left.h"
#include "fem/elements/element.h"
#include "fem/elements/elimination_groups.h"
#include "fem/elements/quasi_definite_schur.h"
#include "fem/elements/surface_coupling.h"
#include "fem/elements/taylor_hood.h"

namespace touchstone::fem {
namespace {

/// Adds three rows of the border, one a component, for each row over nodes.
void add_border(const Eigen::SparseMatrix<double>& rows, double scale, int first, ElementSystem& system) {
  for (int node = 0; node < rows.outerSize(); ++node) {
    if (system.displacement[node] < 0) {
      continue;  // it doesn't move
    }
    for (Eigen::SparseMatrix<double>::InnerIterator entry(rows, node); entry; ++entry) {
      for (int a = 0; a < 3; ++a) {
        system.matrix.add(system.displacement[node] + a, first + 3 * static_cast<int>(entry.row()) + a,
                          scale * entry.value());
      }
    }
  }
}

/// The Taylor-Hood system, or another element's, bordered by what is asked for: three rows a surface vertex, then three
/// a bead. Without units a surface row is int phi_i u / length^2, a bead's row a mean. Both are scaled so that the
/// border is of the order of one beside the elements' blocks.
struct BorderedSystem {
  Scales scales;
  OuterSurface surface;
  ElementSystem system;
  Eigen::SparseMatrix<double> surface_rows;
  double surface_scale = 0.0;
  int unknowns = 0;  ///< without the border
  int border = 0;
};

BorderedSystem bordered_system(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                               std::span<const Bead> beads, Element element) {
  const TaylorHoodSpace space = make_space(mesh, materials);
  BorderedSystem out;
  out.scales = make_scales(mesh, materials);
  out.surface = outer_surface(mesh);
  const int n = static_cast<int>(out.surface.mesh_vertex.size());
  const int m = static_cast<int>(beads.size());
  if (n > kMostSurfaceVertices) {
    fail("the gel's outer surface has {} vertices; at most {} are allowed: mesh the surface coarser", n,
         kMostSurfaceVertices);
  }
  if (m > kMostBeads) fail("there are {} beads; at most {} are allowed", m, kMostBeads);
  const double edge = 1.0 / std::sqrt(static_cast<double>(mesh.outer.size()));
  out.surface_scale = 1.0 / (out.scales.length * out.scales.length * edge);
  out.system = make_system(space, out.scales, materials, element);
  out.unknowns = out.system.matrix.size;
  out.surface_rows = over_nodes_of(element, space, surface_coupling(space, out.surface));
  add_border(out.surface_rows, out.surface_scale, out.unknowns, out.system);
  add_border(over_nodes_of(element, space, bead_means(space, beads)), 1.0, out.unknowns + 3 * n, out.system);
  out.border = 3 * (n + m);
  out.system.matrix.size = out.unknowns + out.border;
  return out;
}

double operations_of(const ElementSystem& system, int border) {
  EliminationGroups plan(system.matrix, border, system.tree);
  double operations = 0.0;
  for (const int root : plan.roots()) operations += plan.groups()[static_cast<std::size_t>(root)].work;
  return operations;
}

/// The surface's compliance with its far parts compressed, and the beads' rows.
struct CompressedBorder {
  SurfaceCompliance surface;
  Eigen::MatrixXd beads;
  double error = 0.0;  ///< see ComplianceReport::compression_error
};

/// `system` has `beads` rows of beads after those of the surface. Some rows more are random combinations of the
/// surface's: the elimination keeps them whole, and so tells what x^T S y is for each two of them. The mean square of
/// how far the compressed matrix is off is the square of its error's Frobenius norm.
CompressedBorder compress_border(ElementSystem system, const Eigen::SparseMatrix<double>& surface_rows,
                                 double surface_scale, const TetMesh& mesh, const OuterSurface& surface, int beads,
                                 FactorReport& factor) {
  constexpr int kProbes = 8;
  constexpr double kTolerance = 1e-3;     // of the mean diagonal entry
  constexpr double kLargestError = 1e-2;  // likewise
  const int n = static_cast<int>(surface.mesh_vertex.size());
  std::mt19937_64 random;
  Eigen::MatrixXd probes(3 * n, kProbes);
  for (double& sign : probes.reshaped()) sign = (random() & 1) != 0 ? 1.0 : -1.0;
  for (int node = 0; node < surface_rows.outerSize(); ++node) {
    if (system.displacement[node] < 0) continue;
    Eigen::Matrix<double, 3, kProbes> sum = Eigen::Matrix<double, 3, kProbes>::Zero();
    for (Eigen::SparseMatrix<double>::InnerIterator entry(surface_rows, node); entry; ++entry) {
      sum += surface_scale * entry.value() * probes.middleRows<3>(3 * entry.row());
    }
    if (sum.isZero(0.0)) continue;
    for (int k = 0; k < kProbes; ++k) {
      for (int a = 0; a < 3; ++a) {
        system.matrix.add(system.displacement[node] + a, system.matrix.size + k, sum(a, k));
      }
    }
  }
  const int whole = 3 * beads + kProbes;
  system.matrix.size += kProbes;
  const std::optional<CompressedSchur> schur =
      compressed_schur(system.matrix, 3 * n + whole, whole, system.tree, &factor);
  if (!schur) {
    fail("the elimination of a gel of {} surface vertices failed; to pivot, at most {} are allowed", n,
         kMostWholeVertices);
  }
  system = {};
  std::vector<Eigen::Vector3d> vertices;
  for (const int vertex : surface.mesh_vertex) vertices.push_back(mesh.vertices[vertex]);
  double diagonal = 0.0;
  const auto columns_of = [&](std::span<const int> asked) {
    std::vector<int> unknowns;
    for (const int v : asked) {
      for (int a = 0; a < 3; ++a) unknowns.push_back(3 * v + a);
    }
    return schur->compressed.columns(unknowns);
  };
  constexpr int kSampled = 64;
  std::vector<int> sampled;
  for (int k = 0; k < kSampled; ++k) sampled.push_back(static_cast<int>(static_cast<std::int64_t>(n) * k / kSampled));
  const Eigen::MatrixXd columns = columns_of(sampled);
  for (int k = 0; k < kSampled; ++k) {
    for (int a = 0; a < 3; ++a) diagonal += std::abs(columns(3 * sampled[k] + a, 3 * k + a)) / (3.0 * kSampled);
  }
  const FarFieldMatrix found(vertices, columns_of, kTolerance * diagonal);
  Eigen::MatrixXd seen(3 * n, kProbes);
  for (int k = 0; k < kProbes; ++k) seen.col(k) = found.times(probes.col(k));
  const Eigen::MatrixXd off = probes.transpose() * seen - schur->whole.bottomRightCorner(kProbes, kProbes);
  double squares = 0.0;
  for (int i = 0; i < kProbes; ++i) {
    for (int j = 0; j < i; ++j) squares += off(i, j) * off(i, j);
  }
  CompressedBorder result{found, schur->whole.topLeftCorner(3 * beads, 3 * n), 0.0};
  result.error = std::sqrt(squares / (0.5 * kProbes * (kProbes - 1.0))) / diagonal;
  if (!(result.error < kLargestError)) {
    fail("compressing the compliance of {} surface vertices left out {:.1e} of its mean diagonal, {:.0e} are allowed",
         n, result.error, kLargestError);
  }
  return result;
}

}  // namespace

Compliance compute_compliance(const TetMesh& mesh, const ElasticMaterial& material, std::span<const Bead> beads,
                              double thickness, const Progress& progress) {
  return compute_compliance(mesh, std::vector<ElasticMaterial>(region_count(mesh), material), beads, thickness,
                            progress);
}

Compliance compute_compliance(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                              std::span<const Bead> beads, double thickness, const Progress& progress) {
  return compute_compliance(mesh, materials, beads, thickness, Element::taylor_hood, progress);
}

Compliance compute_compliance(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                              std::span<const Bead> beads, double thickness, Element element, const Progress& progress,
                              int most_whole) {
  const auto tell = [&](int step) {
    if (progress) {
      progress("elasticity", step, 3);
    }
  };
  if (!std::isfinite(thickness) || thickness <= 0.0) {
    fail("the gel's thickness is {} mm; it must be finite and above zero", thickness);
  }
  const std::size_t tetrahedra = mesh.tetrahedra.size();
  require_memory(setup_bytes(static_cast<double>(tetrahedra)), fmt::format("to set up {} tetrahedra", tetrahedra));
  tell(0);
  BorderedSystem bordered = bordered_system(mesh, materials, beads, element);
  ElementSystem& system = bordered.system;
  const Scales& scales = bordered.scales;
  const OuterSurface& surface = bordered.surface;
  const double surface_scale = bordered.surface_scale;
  const int n = static_cast<int>(surface.mesh_vertex.size());
  const int m = static_cast<int>(beads.size());
  tell(1);

  FactorReport factor;
  Compliance gel;
  // A nodal traction loads the displacements by its coupling row: a border row over surface_scale.
  const double displacement_per_traction = scales.length / scales.stress / (scales.length * scales.length);
  const double surface_factor = -displacement_per_traction / (surface_scale * surface_scale);
  const double bead_factor = -displacement_per_traction / surface_scale;
  if (is_kept_whole(n, m, most_whole)) {
    std::optional<Eigen::MatrixXd> found = quasi_definite_schur(system.matrix, bordered.border, system.tree, &factor);
    if (!found) {  // slower, but it can pivot
      found = schur_complement(system.matrix, bordered.border, system.tree.order, &factor);
    }
    gel.surface = Eigen::MatrixXd(found->topLeftCorner(3 * n, 3 * n) * surface_factor);
    gel.beads = Eigen::MatrixXd(found->bottomLeftCorner(3 * m, 3 * n) * bead_factor);
  } else {
    CompressedBorder found =
        compress_border(std::move(system), bordered.surface_rows, surface_scale, mesh, surface, m, factor);
    gel.surface = found.surface.scaled(surface_factor);
    gel.beads = Eigen::MatrixXd(found.beads * bead_factor);
    gel.report.compression_error = found.error;
  }
  tell(2);

  gel.thickness = thickness;
  gel.material = materials.front();
  for (const int vertex : surface.mesh_vertex) {
    gel.vertices.push_back(mesh.vertices[vertex]);
  }
  gel.triangles = surface.triangles;
  gel.mass = surface_mass(mesh, surface);

  gel.report.tetrahedra = static_cast<int>(mesh.tetrahedra.size());
  gel.report.unknowns = bordered.unknowns;
  gel.report.smallest_dihedral_deg = smallest_dihedral_angle(mesh) * 180.0 / std::numbers::pi;
  gel.report.factor_entries = static_cast<double>(factor.factor_entries);
  gel.report.operations = factor.operations;
  gel.report.memory_mb = factor.memory_mb;
  tell(3);
  return gel;
}

EliminationCount count_elimination(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                                   std::span<const Bead> beads) {
  const BorderedSystem bordered = bordered_system(mesh, materials, beads, Element::taylor_hood);
  return {static_cast<double>(bordered.unknowns), static_cast<double>(bordered.border),
          operations_of(bordered.system, bordered.border)};
}

double count_factorisation(const TetMesh& mesh, std::span<const ElasticMaterial> materials) {
  const TaylorHoodSpace space = make_space(mesh, materials);
  return operations_of(make_system(space, make_scales(mesh, materials), materials, Element::taylor_hood), 0);
}

double setup_bytes(double tetrahedra) {
  constexpr double kPerTetrahedron = 50e3;  // fronts at the elimination's peak, and what they leave to each other
  return kPerTetrahedron * tetrahedra;
}

bool is_kept_whole(int vertices, int beads, int most_whole) {
  return std::sqrt(static_cast<double>(vertices) * (vertices + beads)) <= most_whole;
}

Compliance with_modulus(const Compliance& body, double youngs_modulus) {
  check(ElasticMaterial{youngs_modulus, body.material.poisson_ratio});
  Compliance other = body;
  const double softer = body.material.youngs_modulus / youngs_modulus;
  other.material.youngs_modulus = youngs_modulus;
  other.surface = body.surface.scaled(softer);
  other.beads = SharedMatrix(Eigen::MatrixXd(softer * body.beads.view()));
  return other;
}

}  // namespace touchstone::fem
