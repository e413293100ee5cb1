#include "sensors/tractions/marker_compliance.h"

#include "core/error.h"

#include <fmt/format.h>

#include <cmath>

namespace touchstone::sensors {
namespace {

bool is_grid(const Eigen::Vector2i& grid, int most) {
  return grid.minCoeff() >= 1 && grid.maxCoeff() <= most && grid.prod() <= most;
}

bool is_positive(double value) {
  return std::isfinite(value) && value > 0.0;
}

}  // namespace

std::string fault_of(const MarkerCompliance& compliance) {
  const MarkerCompliance& c = compliance;
  if (!is_grid(c.marker_grid, kMostMarkers)) {
    return fmt::format("its marker grid is {} x {}: 1 to {} markers are allowed", c.marker_grid.x(), c.marker_grid.y(),
                       kMostMarkers);
  }
  if (!is_grid(c.patch_grid, kMostPatches)) {
    return fmt::format("its patch grid is {} x {}: 1 to {} patches are allowed", c.patch_grid.x(), c.patch_grid.y(),
                       kMostPatches);
  }
  if (c.marker_rest.size() != static_cast<std::size_t>(c.markers())) {
    return fmt::format("it has {} rest positions for {} markers", c.marker_rest.size(), c.markers());
  }
  if (c.displacement.rows() != 3 * c.markers() || c.displacement.cols() != 3 * c.patches()) {
    return fmt::format("its matrix is {} x {}, {} x {} are needed", c.displacement.rows(), c.displacement.cols(),
                       3 * c.markers(), 3 * c.patches());
  }
  for (const Eigen::Vector3d& rest : c.marker_rest) {
    if (!rest.allFinite()) return "a rest position isn't finite";
  }
  if (!c.first_patch.allFinite()) return "its first patch isn't at a finite place";
  if (!c.displacement.allFinite()) return "an entry of its matrix isn't finite";
  if (c.displacement.isZero(0.0)) return "its matrix is zero";
  if (!is_positive(c.patch_side)) return fmt::format("patch_side is {} mm, it must be above 0", c.patch_side);
  if (!is_positive(c.thickness)) return fmt::format("thickness is {} mm, it must be above 0", c.thickness);
  if (!is_positive(c.youngs_modulus)) {
    return fmt::format("youngs_modulus is {} MPa, it must be above 0", c.youngs_modulus);
  }
  if (!(c.poisson_ratio > -1.0 && c.poisson_ratio <= 0.5)) {
    return fmt::format("poisson_ratio is {}, it must be above -1 and at most 0.5", c.poisson_ratio);
  }
  return "";
}

MarkerField displacements_under(const MarkerCompliance& compliance, const Eigen::Matrix3Xd& traction) {
  TS_ASSERT(traction.cols() == compliance.patches());
  const Eigen::VectorXd moved =
      compliance.displacement * Eigen::Map<const Eigen::VectorXd>(traction.data(), traction.size());
  MarkerField field;
  field.grid = compliance.marker_grid;
  field.measured.assign(static_cast<std::size_t>(compliance.markers()), 1);
  for (int marker = 0; marker < compliance.markers(); ++marker) {
    field.displacement.emplace_back(moved.segment<3>(3 * marker));
  }
  return field;
}

}  // namespace touchstone::sensors
