#include "sensors/tractions/bead_field.h"

#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

void check_number(std::size_t positions, const char* which, const MarkerCompliance& compliance) {
  if (positions != compliance.marker_rest.size()) {
    fail("beads: there are {} {} positions, the compliance is of {} x {} beads", positions, which,
         compliance.marker_grid.x(), compliance.marker_grid.y());
  }
}

}  // namespace

Eigen::Vector2d BeadView::lateral_mm(const Eigen::Vector2d& motion_px) const {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return Eigen::Vector2d(c * motion_px.x() + s * motion_px.y(), c * motion_px.y() - s * motion_px.x()) / px_per_mm;
}

BeadView view_of(std::span<const Eigen::Vector2d> rest_px, const MarkerCompliance& compliance) {
  check_number(rest_px.size(), "rest", compliance);
  if (rest_px.size() < 2) fail("beads: one bead alone gives no scale");
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero(), mean_mm = Eigen::Vector2d::Zero();
  const double count = static_cast<double>(rest_px.size());
  for (std::size_t i = 0; i < rest_px.size(); ++i) {
    if (!rest_px[i].allFinite()) fail("beads: the rest position of bead {} isn't finite", i);
    mean_px += rest_px[i] / count;
    mean_mm += compliance.marker_rest[i].head<2>() / count;
  }
  // Least squares of a similarity: sums of (mm)* (px), taken as complex numbers, over sums of |mm|^2.
  double along = 0.0, across = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < rest_px.size(); ++i) {
    const Eigen::Vector2d px = rest_px[i] - mean_px;
    const Eigen::Vector2d mm = compliance.marker_rest[i].head<2>() - mean_mm;
    along += mm.dot(px);
    across += mm.x() * px.y() - mm.y() * px.x();
    squares += mm.squaredNorm();
  }
  BeadView view;
  view.px_per_mm = std::hypot(along, across) / squares;
  view.turn_rad = std::atan2(across, along);
  if (!(view.px_per_mm > 0.0 && std::isfinite(view.px_per_mm))) fail("beads: their rest positions all coincide");
  double aside = 0.0;
  for (std::size_t i = 0; i < rest_px.size(); ++i) {
    const Eigen::Vector2d mm = compliance.marker_rest[i].head<2>() - mean_mm;
    aside += (view.px_per_mm * (view.lateral_mm(rest_px[i] - mean_px) - mm)).squaredNorm();
  }
  view.rms_px = std::sqrt(aside / count);
  const double spacing_px = view.px_per_mm * (compliance.marker_rest[1] - compliance.marker_rest[0]).head<2>().norm();
  if (view.rms_px > 0.2 * spacing_px || std::abs(view.turn_rad) > 0.5) {
    fail(
        "beads: at rest they lie {:.1f} px aside from the compliance's grid of {} x {}, turned by {:.0f} degrees; at "
        "most "
        "a fifth of their spacing of {:.1f} px and 29 degrees are allowed",
        view.rms_px, compliance.marker_grid.x(), compliance.marker_grid.y(), view.turn_rad * 180.0 / 3.14159265358979,
        spacing_px);
  }
  Eigen::Vector2d origin_mm = -mean_mm;
  const double c = std::cos(view.turn_rad), s = std::sin(view.turn_rad);
  view.offset_px = mean_px + view.px_per_mm * Eigen::Vector2d(c * origin_mm.x() - s * origin_mm.y(),
                                                              s * origin_mm.x() + c * origin_mm.y());
  return view;
}

MarkerField bead_field(const TrackedBeads& beads, std::span<const Eigen::Vector2d> rest_px, const BeadView& view,
                       const MarkerCompliance& compliance) {
  check_number(beads.positions.size(), "tracked", compliance);
  check_number(rest_px.size(), "rest", compliance);
  MarkerField field;
  field.grid = compliance.marker_grid;
  field.displacement.assign(rest_px.size(), Eigen::Vector3d::Zero());
  field.measured.assign(rest_px.size(), 0);
  for (std::size_t i = 0; i < rest_px.size(); ++i) {
    if (!is_found(beads.status[i])) continue;
    field.measured[i] = 1;
    field.displacement[i].head<2>() = view.lateral_mm(beads.positions[i] - rest_px[i]);
  }
  return field;
}

}  // namespace touchstone::sensors
