#pragma once
// Was the frame that was taken for rest touched? Markers are printed in rows, and whatever touches the gel bends them.
// So of two frames the one whose rows are straighter is nearer to rest. The measure is our own.
//
// A bend is how far a marker is from the middle between two neighbours that lie opposite each other. From one frame to
// the other it changes by d. If the first frame is at rest, it was 0 there but for the print's own errors, and d adds
// to it; if the second one is, d takes it away. The part
//   nearer = (sum of squares in the first frame - sum of squares in the second) / sum of squares of d
// is -1 in the first case and 1 in the second. A layout's own bends e (a print's errors, rings, markers at random, a
// lens) have nothing to do with d, and add an error of some 2 |e| / (|d| sqrt(n)): where markers don't lie in rows, or
// little moves, nothing is said.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace touchstone::sensors {

/// A marker and two neighbours that lie opposite each other, by their numbers.
using MarkerTriple = std::array<int, 3>;

/// All of them in a layout: neighbours within 1.35 spacings, whose middle is within a quarter of a spacing of the
/// marker.
std::vector<MarkerTriple> opposite_neighbours(std::span<const Eigen::Vector2d> places, double spacing_px);

/// What a frame says of the one that was taken for rest.
struct RestDoubt {
  int triples = 0;         ///< that it stands on: all three measured
  double change_px = 0.0;  ///< root mean square of how the bends changed
  double bend_px = 0.0;    ///< root mean square of the bends in this frame
  double nearer = -1.0;    ///< as above
  double error = 0.0;      ///< its standard error

  /// The frame at rest was touched, beyond doubt: much of its bends is gone. The thresholds were set before any frame
  /// was looked at.
  bool rest_was_touched() const { return triples >= 9 && change_px > 0.1 && nearer - 3.0 * error > 0.5; }
};

/// Compares the places of markers in two frames, px.
/// @param triples of the first one @param found not 0 where a marker is measured in both
RestDoubt rest_doubt(std::span<const MarkerTriple> triples, std::span<const Eigen::Vector2d> rest,
                     std::span<const Eigen::Vector2d> now, std::span<const unsigned char> found);

}  // namespace touchstone::sensors
