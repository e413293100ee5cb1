#pragma once

#include <span>

#include "fem/elements/compliance.h"
#include "fem/mesh/gel_body.h"
#include "fem/mesh/slab.h"

namespace touchstone::fem {

/// What setting a gel up takes, before anything is meshed.
struct SetupEstimate {
  double tetrahedra = 0.0;
  double surface_vertices = 0.0;
  double file_bytes = 0.0;   ///< of the compliance in the cache
  double setup_bytes = 0.0;  ///< see fem::setup_bytes()
};

/// From the size field; measured on slabs of 8,000 to 46,000 tetrahedra: vertices within 10 %, the file within 20 %,
/// the memory within 40 %.
SetupEstimate estimate_setup(const SlabMesh& slab, int beads);

/// What setting a gel up takes, counted on its meshes: its own and those that its mesh error is measured on
/// (ladder_factors). Sums over them.
struct SetupCount {
  fem::EliminationCount eliminations;
  double presses = 0.0;  ///< radii by gels on which reference bodies are pressed (ladder_radii); 0 without a ladder
};

/// Meshes the gel and counts; costs some percent of the set-up. @throws Error as mesh_gel() and count_elimination()
SetupCount count_setup(const GelBody& body, std::span<const ElasticMaterial> materials, std::span<const Bead> beads);

/// Bytes that a press takes beside the mapped file with a disc of radius `reach` in contact, meshed with `edge` (mm).
double press_bytes(double edge, double reach);

}  // namespace touchstone::fem
