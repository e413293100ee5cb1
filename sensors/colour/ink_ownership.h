#pragma once
// Which filter's marker a patch of ink is. Filters are rigid and stay where they were at rest, so they decide; a soft
// marker that has moved by a whole spacing looks as if it were its neighbour at rest. That can't be seen in one marker,
// but it can in the grid: the gel holds together, so between markers at home and markers one filter off lie some under
// two filters, and at the grid's edge a marker comes to lie under no filter.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sensors/colour/colour_marker.h"

namespace touchstone::sensors {

/// One connected patch of ink.
struct InkPatch {
  int area_px = 0;
  bool at_border = false;  ///< the picture's edge cuts it
  std::vector<int> under;  ///< px of it under each marker's filter
};

/// What a patch must be like to be a marker's own.
struct InkRules {
  double usual_area_px = 0.0;         ///< of a filter
  double most_under_neighbour = 0.1;  ///< part of a patch's area
};

/// Whose each patch of ink is, and which markers can't be measured for that.
struct InkOwners {
  std::vector<int> owner;         ///< of each patch: a marker, or -1
  std::vector<MarkerFlaw> flaws;  ///< of each marker: none, missing (no ink is its own), two filters, cut off
  int stray = 0;  ///< patches of at least 0.35 of the usual area that have less than a fifth under any filter
};

/// A patch belongs to the filter that most of it is under. Two filters: more than the rules' part of the patch is under
/// others' filters (which are then flawed too, if so much of it is theirs), two patches of more than half the usual
/// area are one marker's, or a patch is so large (1.8 of the usual area) that it is two markers'.
InkOwners own_ink(const std::vector<InkPatch>& patches, std::size_t markers, const InkRules& rules);

/// Marks as under two filters every marker that may be its neighbour: if some markers are flawed so, or have lost
/// their ink, those that aren't joined to the grid's rim by a chain of sound neighbours along rows and columns, each
/// moved about as the one before: to 0.3 spacings, where a marker that is one filter off would have to differ by 0.7.
/// @param shift each marker's ink's displacement from rest, in spacings; read where there's no flaw
/// @param missing_at_rest markers whose missing ink means nothing
void doubt_enclosed(const Eigen::Vector2i& grid, const std::vector<Eigen::Vector2d>& shift,
                    const std::vector<std::uint8_t>& missing_at_rest, std::vector<MarkerFlaw>& flaws);

}  // namespace touchstone::sensors
