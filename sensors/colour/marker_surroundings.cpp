#include "sensors/colour/marker_surroundings.h"

#include <Eigen/LU>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

bool is_usable(const ColourMarkerReading& rest, const ColourMarkerReading& reading, std::size_t marker) {
  return rest.markers[marker].flaw == MarkerFlaw::kNone && reading.markers[marker].flaw == MarkerFlaw::kNone;
}

}  // namespace

void find_surroundings(const ColourMarkerReading& rest, ColourMarkerReading& reading) {
  TS_ASSERT(rest.grid == reading.grid && rest.markers.size() == reading.markers.size());
  const int columns = reading.grid.x();
  const int rows = reading.grid.y();
  for (int i = 0; i < columns * rows; ++i) {
    const auto marker = static_cast<std::size_t>(i);
    MarkerSurroundings& found = reading.markers[marker].surroundings;
    found = {};
    if (!is_usable(rest, reading, marker)) continue;
    const Eigen::Vector2i place(i % columns, i / columns);
    Eigen::Matrix2d cell_at_rest;
    Eigen::Matrix2d cell;
    int neighbours = 0;
    double log_ink_area = 0.0;
    bool known = true;
    for (int axis = 0; axis < 2; ++axis) {
      // From the neighbour before it to the one after it; in the place of one that isn't there, the marker itself.
      std::size_t ends[2] = {marker, marker};
      int steps = 0;
      for (const int side : {0, 1}) {
        const int along = place[axis] + (side == 0 ? -1 : 1);
        if (along < 0 || along >= reading.grid[axis]) continue;
        const auto neighbour = static_cast<std::size_t>(i + (side == 0 ? -1 : 1) * (axis == 0 ? 1 : columns));
        if (!is_usable(rest, reading, neighbour)) continue;
        ends[side] = neighbour;
        ++steps;
        ++neighbours;
        log_ink_area += std::log(reading.markers[neighbour].ink_area_px / rest.markers[neighbour].ink_area_px);
      }
      if (steps == 0) {
        known = false;
        break;
      }
      const auto span = [&](const ColourMarkerReading& of) -> Eigen::Vector2d {
        return (of.markers[ends[1]].ink_centroid_px - of.markers[ends[0]].ink_centroid_px) / steps;
      };
      cell_at_rest.col(axis) = span(rest);
      cell.col(axis) = span(reading);
    }
    if (!known) continue;
    // A cell that is folded over has no logarithm.
    const double growth = cell.determinant() / cell_at_rest.determinant();
    if (!(growth > 0.0)) continue;
    found = {true, std::log(growth), log_ink_area / neighbours};
  }
}

}  // namespace touchstone::sensors
