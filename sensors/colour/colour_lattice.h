#pragma once
// Finds a square grid of coloured regions on white in one picture, whatever its size, turn (up to 45 degrees) and
// place: the first look at a sensor at rest, from which all else is measured.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

/// Places row by row: y grows from row to row, x along a row.
struct ColourLattice {
  double spacing_px = 0.0;
  std::vector<Eigen::Vector2d> places;  ///< px; of a region that wasn't seen, where its neighbours put it
  std::vector<std::uint8_t> seen;       ///< 0 or 1

  /// How many markers were seen at their place.
  int count_seen() const;
};

/// The part of the grid's regions that must be seen.
inline constexpr double kLeastLatticeSeen = 0.7;

/// Regions are 4-connected pixels whose saturation (HSV, against the picture's own white) is above 0.4: about the
/// half-covered rim of a region of full colour. Regions of about one size that lie on a common grid are its nodes.
/// @param image CV_8UC3
/// @param grid columns and rows asked for
/// @param spacing_px expected distance between neighbours, within 25 %; 0: any
/// @throws Error if the picture is dark, overexposed, without colour, or shows another number of columns or rows, or
///   less than kLeastLatticeSeen of the regions: it says what is seen and what was asked
ColourLattice find_colour_lattice(const cv::Mat& image, const Eigen::Vector2i& grid, double spacing_px = 0.0);

}  // namespace touchstone::sensors
