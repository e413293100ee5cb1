#include "fem/error/setup_estimate.h"

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "fem/elements/compliance.h"
#include "fem/elements/compliance_file.h"
#include "fem/error/mesh_error.h"

namespace touchstone::fem {
namespace {

/// Bytes per pair of vertices in contact: two dense blocks of three unknowns each.
constexpr double kPressBytesPerPair = 2.0 * 72.0;

}  // namespace

SetupEstimate estimate_setup(const SlabMesh& slab, int beads) {
  SetupEstimate estimate;
  estimate.tetrahedra = estimated_tetrahedra(slab);
  estimate.surface_vertices = estimated_surface_vertices(slab);
  estimate.file_bytes = compliance_file_bytes(static_cast<int>(std::lround(estimate.surface_vertices)), beads);
  estimate.setup_bytes = fem::setup_bytes(estimate.tetrahedra);
  return estimate;
}

SetupCount count_setup(const GelBody& body, std::span<const ElasticMaterial> materials, std::span<const Bead> beads) {
  SetupCount sum;
  EliminationCount& all = sum.eliminations;
  const auto add = [&](const GelBody& one) {
    const EliminationCount count = count_elimination(mesh_gel(one), materials, beads);
    all.unknowns += count.unknowns;
    all.border += count.border;
    all.operations += count.operations;
  };
  add(body);
  const LadderGel ladder = ladder_of(body, materials, beads);
  const std::vector<double> factors = ladder_factors(ladder.largest_factor);
  int gels = 1;
  for (const double factor : factors) {
    try {
      add(with_edges(body, factor));
      ++gels;
    } catch (const Error&) {
      continue;  // set-up leaves it out, too
    }
  }
  if (!factors.empty()) sum.presses = gels * ladder_radii(ladder);
  return sum;
}

double press_bytes(double edge, double reach) {
  const double touching = 2.0 / std::sqrt(3.0) * std::numbers::pi * reach * reach / (edge * edge);
  return kPressBytesPerPair * touching * touching;
}

}  // namespace touchstone::fem
