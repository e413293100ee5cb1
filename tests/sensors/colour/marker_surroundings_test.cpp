// What a marker's neighbours tell: on grids that were stretched by hand.

#include "sensors/colour/marker_surroundings.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace touchstone::sensors {
namespace {

/// A grid of 5 x 5 in which all is sound.
ColourMarkerReading even_grid() {
  ColourMarkerReading reading;
  reading.grid = {5, 5};
  for (int i = 0; i < 25; ++i) {
    ColourMarker marker;
    marker.flaw = MarkerFlaw::kNone;
    marker.ink_centroid_px = {100.0 + 30.0 * (i % 5), 50.0 + 30.0 * (i / 5)};
    marker.ink_area_px = 400.0 + i;
    reading.markers.push_back(marker);
  }
  return reading;
}

// The determinant of what the whole grid is mapped by is what each cell grows by, whichever neighbours tell it.
TEST(MarkerSurroundings, AnAffineMapsDeterminantIsFoundEverywhere) {
  const ColourMarkerReading rest = even_grid();
  Eigen::Matrix2d map;
  map << 1.1, 0.2, -0.1, 0.95;
  ColourMarkerReading seen = rest;
  for (ColourMarker& marker : seen.markers) {
    marker.ink_centroid_px = map * marker.ink_centroid_px + Eigen::Vector2d(7, -3);
    marker.ink_area_px *= 1.3;
  }
  seen.markers[12].flaw = MarkerFlaw::kTwoFilters;  // its neighbours make do with the others
  find_surroundings(rest, seen);
  for (std::size_t i = 0; i < seen.markers.size(); ++i) {
    const MarkerSurroundings& found = seen.markers[i].surroundings;
    EXPECT_EQ(found.known, i != 12) << i;
    if (!found.known) continue;
    EXPECT_NEAR(found.log_cell_area, std::log(map.determinant()), 1e-12) << i;
    EXPECT_NEAR(found.log_ink_area, std::log(1.3), 1e-12) << i;
  }
}

TEST(MarkerSurroundings, AtRestNothingHasChanged) {
  ColourMarkerReading rest = even_grid();
  find_surroundings(rest, rest);
  for (const ColourMarker& marker : rest.markers) {
    EXPECT_TRUE(marker.surroundings.known);
    EXPECT_EQ(marker.surroundings.log_cell_area, 0.0);
    EXPECT_EQ(marker.surroundings.log_ink_area, 0.0);
  }
}

// The marker's own size isn't among them: it is given separately.
TEST(MarkerSurroundings, OnlyTheNeighboursSizesCount) {
  const ColourMarkerReading rest = even_grid();
  ColourMarkerReading seen = rest;
  seen.markers[12].ink_area_px *= 2.0;
  find_surroundings(rest, seen);
  EXPECT_EQ(seen.markers[12].surroundings.log_ink_area, 0.0);
  EXPECT_NEAR(seen.markers[13].surroundings.log_ink_area, std::log(2.0) / 4, 1e-12);
}

TEST(MarkerSurroundings, WithoutANeighbourAlongBothAxesTheyAreUnknown) {
  ColourMarkerReading rest = even_grid();
  rest.markers[11].flaw = rest.markers[13].flaw = MarkerFlaw::kMissing;
  ColourMarkerReading seen = rest;
  find_surroundings(rest, seen);
  EXPECT_FALSE(seen.markers[12].surroundings.known);
  EXPECT_TRUE(seen.markers[17].surroundings.known);
  // One that was missing at rest doesn't count when it is seen later.
  seen.markers[11].flaw = seen.markers[13].flaw = MarkerFlaw::kNone;
  find_surroundings(rest, seen);
  EXPECT_FALSE(seen.markers[12].surroundings.known);
}

TEST(MarkerSurroundings, AFoldedCellIsUnknown) {
  const ColourMarkerReading rest = even_grid();
  ColourMarkerReading seen = rest;
  std::swap(seen.markers[11].ink_centroid_px, seen.markers[13].ink_centroid_px);
  find_surroundings(rest, seen);
  EXPECT_FALSE(seen.markers[12].surroundings.known);
}

}  // namespace
}  // namespace touchstone::sensors
