#include "sensors/colour/marker_change.h"

#include <cmath>

#include "core/error.h"
#include "sensors/colour/hue.h"

namespace touchstone::sensors {

Eigen::Matrix<double, MarkerChange::kSize, 1> MarkerChange::vector() const {
  Eigen::Matrix<double, kSize, 1> all;
  all << hue, centroid_mm, ink_centroid_mm, log_coloured_area, log_ink_area, log_cell_area, log_neighbour_area;
  return all;
}

void MarkerChange::forget_surroundings() {
  surroundings_known = false;
  log_cell_area = 0.0;
  log_neighbour_area = 0.0;
}

MarkerChange change_of(const ColourMarker& seen, const ColourMarker& rest, const PictureMap& map) {
  TS_ASSERT(seen.flaw == MarkerFlaw::kNone && rest.flaw == MarkerFlaw::kNone);
  MarkerChange change;
  change.hue = hue_difference(seen.hue, rest.hue);
  change.centroid_mm = map(seen.centroid_px) - map(rest.centroid_px);
  change.ink_centroid_mm = map(seen.ink_centroid_px) - map(rest.ink_centroid_px);
  change.log_coloured_area = std::log(seen.coloured_area_px / rest.coloured_area_px);
  change.log_ink_area = std::log(seen.ink_area_px / rest.ink_area_px);
  change.surroundings_known = seen.surroundings.known;
  if (change.surroundings_known) {
    change.log_cell_area = seen.surroundings.log_cell_area;
    change.log_neighbour_area = seen.surroundings.log_ink_area;
  }
  return change;
}

Eigen::Vector2d ViewParallax::seen(const Eigen::Vector3d& displacement, const Eigen::Vector2d& rest) const {
  if (viewing_distance_mm == 0.0) return displacement.head<2>();
  const Eigen::Vector2d from_axis = rest - axis_mm;
  const double nearer = viewing_distance_mm / (viewing_distance_mm + displacement.z());
  return (from_axis + displacement.head<2>()) * nearer - from_axis;
}

Eigen::Vector2d ViewParallax::true_one(const Eigen::Vector2d& seen, double press_mm,
                                       const Eigen::Vector2d& rest) const {
  if (viewing_distance_mm == 0.0) return seen;
  const Eigen::Vector2d from_axis = rest - axis_mm;
  return (seen + from_axis) * (1.0 - press_mm / viewing_distance_mm) - from_axis;
}

}  // namespace touchstone::sensors
