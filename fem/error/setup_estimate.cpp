#include "fem/error/setup_estimate.h"

#include <cmath>
#include <numbers>

#include "fem/elements/compliance.h"
#include "fem/elements/compliance_file.h"

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

double press_bytes(double edge, double reach) {
  const double touching = 2.0 / std::sqrt(3.0) * std::numbers::pi * reach * reach / (edge * edge);
  return kPressBytesPerPair * touching * touching;
}

}  // namespace touchstone::fem
