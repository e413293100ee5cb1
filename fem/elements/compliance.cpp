#include "fem/elements/compliance.h"

#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "fem/elements/element.h"
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
                              std::span<const Bead> beads, double thickness, Element element,
                              const Progress& progress) {
  const auto tell = [&](int step) {
    if (progress) {
      progress("elasticity", step, 3);
    }
  };
  if (!std::isfinite(thickness) || thickness <= 0.0) {
    fail("the gel's thickness is {} mm; it must be finite and above zero", thickness);
  }
  tell(0);
  const TaylorHoodSpace space = make_space(mesh, materials);
  const Scales scales = make_scales(mesh, materials);
  const OuterSurface surface = outer_surface(mesh);
  const int n = static_cast<int>(surface.mesh_vertex.size());
  const int m = static_cast<int>(beads.size());
  if (std::sqrt(static_cast<double>(n) * (n + m)) > kMostSurfaceVertices) {
    fail(
        "the gel's outer surface has {} vertices and there are {} beads: their compliance would take {:.0f} MB; "
        "at most {:.0f} are allowed: mesh the surface coarser",
        n, m, 72e-6 * n * (static_cast<double>(n) + m), 72e-6 * kMostSurfaceVertices * kMostSurfaceVertices);
  }

  // Without units, a surface row is int phi_i u / length^2, a bead's row a mean. Both are scaled so that the border is
  // of the order of one beside the elements' blocks.
  const double edge = 1.0 / std::sqrt(static_cast<double>(mesh.outer.size()));
  const double surface_scale = 1.0 / (scales.length * scales.length * edge);
  ElementSystem system = make_system(space, scales, materials, element);
  const int unknowns = system.matrix.size;
  add_border(over_nodes_of(element, space, surface_coupling(space, surface)), surface_scale, unknowns, system);
  add_border(over_nodes_of(element, space, bead_means(space, beads)), 1.0, unknowns + 3 * n, system);
  system.matrix.size = unknowns + 3 * (n + m);
  tell(1);

  FactorReport factor;
  std::optional<Eigen::MatrixXd> found = quasi_definite_schur(system.matrix, 3 * (n + m), system.tree, &factor);
  if (!found) {  // slower, but it can pivot
    found = schur_complement(system.matrix, 3 * (n + m), system.tree.order, &factor);
  }
  const Eigen::MatrixXd& schur = *found;
  tell(2);

  Compliance gel;
  gel.thickness = thickness;
  gel.material = materials.front();
  for (const int vertex : surface.mesh_vertex) {
    gel.vertices.push_back(mesh.vertices[vertex]);
  }
  gel.triangles = surface.triangles;
  gel.mass = surface_mass(mesh, surface);
  // A nodal traction loads the displacements by its coupling row: a border row over surface_scale.
  const double displacement_per_traction = scales.length / scales.stress / (scales.length * scales.length);
  gel.surface = Eigen::MatrixXd(schur.topLeftCorner(3 * n, 3 * n) *
                                (-displacement_per_traction / (surface_scale * surface_scale)));
  gel.beads = Eigen::MatrixXd(schur.bottomLeftCorner(3 * m, 3 * n) * (-displacement_per_traction / surface_scale));

  gel.report.tetrahedra = static_cast<int>(mesh.tetrahedra.size());
  gel.report.unknowns = unknowns;
  gel.report.smallest_dihedral_deg = smallest_dihedral_angle(mesh) * 180.0 / std::numbers::pi;
  gel.report.factor_entries = static_cast<double>(factor.factor_entries);
  gel.report.operations = factor.operations;
  gel.report.memory_mb = factor.memory_mb;
  tell(3);
  return gel;
}

Compliance with_modulus(const Compliance& body, double youngs_modulus) {
  check(ElasticMaterial{youngs_modulus, body.material.poisson_ratio});
  Compliance other = body;
  const double softer = body.material.youngs_modulus / youngs_modulus;
  other.material.youngs_modulus = youngs_modulus;
  other.surface = SharedMatrix(Eigen::MatrixXd(softer * body.surface.view()));
  other.beads = SharedMatrix(Eigen::MatrixXd(softer * body.beads.view()));
  return other;
}

}  // namespace touchstone::fem
