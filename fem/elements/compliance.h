#pragma once
// What the gel's outer surface does under tractions: all that contact needs to know of the elastic body.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "fem/elements/elastic_material.h"
#include "fem/elements/mesh_error_table.h"
#include "fem/elements/shared_matrix.h"
#include "fem/elements/surface_compliance.h"
#include "fem/mesh/tet_mesh.h"

namespace touchstone::fem {

/// A rigid ball inside the gel, seen as a marker. Gel frame, mm.
struct Bead {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0.0;
};

/// What making a compliance took, and how good its mesh is. The same mesh gives the same report.
struct ComplianceReport {
  int tetrahedra = 0;
  int unknowns = 0;                    ///< displacements and pressures
  double smallest_dihedral_deg = 0.0;  ///< under some 5 degrees, expect loss of accuracy, but in flat prisms of layers
  double fine_edge = 0.0;              ///< mm, where contact is made; 0 if who asked for the mesh didn't say
  double factor_entries = 0.0;
  double operations = 0.0;         ///< floating-point operations of the elimination
  double memory_mb = 0.0;          ///< of the elimination on one thread
  double compression_error = 0.0;  ///< of a surface compliance whose far parts are compressed: Frobenius norm of what
                                   ///< that left out, over the mean diagonal entry, measured
  std::string note;                ///< from the cache: empty, or what was wrong with the file there; not stored
};

/// Linear response of the gel to tractions on its outer surface, which are P1 on its triangles. Degree of freedom
/// 3*i + a is component a (gel frame) at surface vertex i.
struct Compliance {
  double thickness = 0.0;                     ///< mm
  ElasticMaterial material;                   ///< of region 0: the gel's body
  std::vector<Eigen::Vector3d> vertices;      ///< n vertices of the outer surface, mm
  std::vector<std::array<int, 3>> triangles;  ///< over `vertices`, normal out
  Eigen::SparseMatrix<double> mass;  ///< n x n: int phi_i phi_j dA, mm^2 (P1 hats); its row sums are the weights
  SurfaceCompliance surface;  ///< 3n x 3n, symmetric positive definite: int phi_i u_a dA (mm^3) per traction (MPa)
  SharedMatrix beads;         ///< 3m x 3n: mean displacement of a bead's surface (mm) per traction (MPa)
  ComplianceReport report;
  MeshErrorTable mesh_error;  ///< empty if it wasn't measured (see fem/error/mesh_error.h)
};

/// Eliminates the gel's inside once. The Taylor-Hood system K is bordered by the rows C that take displacements to what
/// is asked for (int phi_i u_a over the outer surface; the mean over each bead's surface); the Schur complement of
/// [K C^T; C 0] on the border is -C K^-1 C^T. A bead is a rigid sphere that moves with the gel and doesn't stiffen it:
/// it goes where the gel's mean over its surface goes (Faxen's law [Faxen1922] for a sphere without a force on it). The
/// vertices keep the mesh's order. Of a large surface the far parts are compressed: what that leaves out is measured
/// and in the report. `materials` has one entry for each region of the mesh. `thickness` is copied.
/// @throws Error for an unfit mesh (see fault_of) or material, for a bead that isn't wholly inside the gel, for more
/// vertices or beads than are allowed, or, before it begins, if less memory is left than setup_bytes()
Compliance compute_compliance(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                              std::span<const Bead> beads, double thickness, const Progress& progress = {});
Compliance compute_compliance(const TetMesh& mesh, const ElasticMaterial& material, std::span<const Bead> beads,
                              double thickness, const Progress& progress = {});  ///< the same in all regions

/// What eliminating a gel's inside takes, counted before there is any number.
struct EliminationCount {
  double unknowns = 0.0;    ///< displacements and pressures
  double border = 0.0;      ///< rows of the surface and of beads
  double operations = 0.0;  ///< floating-point; of a surface whose far parts are compressed more than it takes
};

/// Of what compute_compliance() would do with the same arguments, as its report has it; costs some percent of that.
/// @throws Error as compute_compliance(), but for want of memory
EliminationCount count_elimination(const TetMesh& mesh, std::span<const ElasticMaterial> materials,
                                   std::span<const Bead> beads);

/// Operations of one factorisation of the whole gel without a border, as each Newton iterate at finite strain makes
/// one.
/// @throws Error likewise
double count_factorisation(const TetMesh& mesh, std::span<const ElasticMaterial> materials);

/// Bytes that this takes at the most for so many tetrahedra, on four threads, within some 40 %.
double setup_bytes(double tetrahedra);

/// The same body with all its moduli times one number, so that its (first) material's is this: linear elasticity only
/// divides by it. @throws Error unless the modulus is finite and above zero
Compliance with_modulus(const Compliance& body, double youngs_modulus);

/// Vertices n and beads m with sqrt(n (n + m)) up to this have their compliance whole, which then takes 487 MB; of
/// larger surfaces the far parts are compressed.
inline constexpr int kMostWholeVertices = 2600;
/// Whether this many have it whole.
bool is_kept_whole(int vertices, int beads, int most_whole = kMostWholeVertices);
/// More vertices, or more beads, are refused.
inline constexpr int kMostSurfaceVertices = 8000;
inline constexpr int kMostBeads = 1000;  ///< likewise

}  // namespace touchstone::fem
