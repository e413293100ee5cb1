#include "sensors/tractions/seen_markers.h"

#include "core/error.h"

namespace touchstone::sensors {

namespace {

void check_grid(const MarkerField& field, const MarkerCompliance& compliance) {
  if (field.grid != compliance.marker_grid || field.displacement.size() != compliance.marker_rest.size() ||
      field.measured.size() != compliance.marker_rest.size()) {
    fail("markers as seen: the field has a grid of {} x {}, the compliance {} x {}", field.grid.x(), field.grid.y(),
         compliance.marker_grid.x(), compliance.marker_grid.y());
  }
}

}  // namespace

MarkerField as_seen(MarkerField field, const MarkerCompliance& compliance, const ViewParallax& parallax) {
  check_grid(field, compliance);
  for (std::size_t m = 0; m < field.displacement.size(); ++m) {
    Eigen::Vector3d& displacement = field.displacement[m];
    if (field.measured[m]) {
      displacement.head<2>() = parallax.seen(displacement, compliance.marker_rest[m].head<2>()).eval();
    }
  }
  return field;
}

MarkerField as_they_are(MarkerField seen, const MarkerCompliance& compliance, const ViewParallax& parallax) {
  check_grid(seen, compliance);
  for (std::size_t m = 0; m < seen.displacement.size(); ++m) {
    Eigen::Vector3d& displacement = seen.displacement[m];
    displacement.head<2>() =
        parallax.true_one(displacement.head<2>(), -displacement.z(), compliance.marker_rest[m].head<2>()).eval();
  }
  return seen;
}

MarkerCompliance as_seen(MarkerCompliance compliance, const ViewParallax& parallax) {
  const std::string fault = fault_of(compliance);
  if (!fault.empty()) fail("markers as seen: {}", fault);
  if (parallax.viewing_distance_mm == 0.0) return compliance;
  for (int m = 0; m < compliance.markers(); ++m) {
    const Eigen::Vector2d off_axis = compliance.marker_rest[static_cast<std::size_t>(m)].head<2>() - parallax.axis_mm;
    for (int a = 0; a < 2; ++a) {
      compliance.displacement.row(3 * m + a) -=
          off_axis[a] / parallax.viewing_distance_mm * compliance.displacement.row(3 * m + 2);
    }
  }
  return compliance;
}

}  // namespace touchstone::sensors
