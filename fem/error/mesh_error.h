#pragma once
// The error that a mesh makes, found by pressing the same bodies on meshes of other edge lengths.
//
// A gel's ladder is the gel itself and the same gel with all its edges multiplied by other factors. On each, spheres
// and sharp flat punches of several contact radii a are pressed without friction to the same depth, and pressed and
// sheared without slip, at the same few positions, which lie differently in each mesh. Most of the error is of the kind
// that depends on how the edge of the contact lies among the vertices, and is as good as random between two meshes, so
// the differences D between levels i and 0 add up as D^2 = e_i^2 + e_0^2. With e = C a^-q h^p, p and q are the observed
// orders, and e_0 is what remains when the ladder is extrapolated to h = 0 (Richardson's idea, with squares in place of
// signed differences). An error is thus a root mean square: two of three presses are off by less.
// It's the error of the mesh alone: not of linear elasticity at large strains, nor of the contact solver's tolerance.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "fem/elements/compliance.h"
#include "fem/mesh/gel_body.h"

namespace touchstone::fem {

/// What the ladder needs to know of a gel.
struct LadderGel {
  double edge = 0.0;                                ///< mm, where contact is made
  double largest_radius = 0.0;                      ///< mm: contacts up to it stay where the edges are `edge`
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< on the outer surface, where its normal is +z
  /// The same gel, its edges multiplied by the factor. @throws Error if it can't be meshed so
  std::function<Compliance(double factor)> with_edges;
  double largest_factor = 2.0;  ///< coarser isn't a mesh of that gel any more
};

/// By what the edges of the ladder's coarser gels are multiplied, rising; none where the gel can't be meshed 1.3 times
/// as coarsely. `largest_factor` as LadderGel's.
std::vector<double> ladder_factors(double largest_factor);

/// On how many radii bodies are pressed, on each of the ladder's gels; more where one of them finds no contact.
int ladder_radii(const LadderGel& ladder);

/// The ladder of a gel: radii as far as its fine part goes, edges up to its thickness.
LadderGel ladder_of(const GelBody& body, std::span<const ElasticMaterial> materials, std::span<const Bead> beads);
LadderGel ladder_of(const SlabMesh& slab, const ElasticMaterial& material, std::span<const Bead> beads);

/// Measures the table for `gel`, which is the ladder's with factor 1. Empty if the gel can't be meshed 1.3 times as
/// coarsely: its edges are about its thickness, and nothing is known of its errors but that they are large.
MeshErrorTable measure_mesh_error(const Compliance& gel, const LadderGel& ladder, const Progress& progress = {});

}  // namespace touchstone::fem
