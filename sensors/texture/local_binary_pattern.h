#pragma once
// Local binary patterns on a circle, rotation invariant and "uniform" [Ojala2002], as [Li2015, ch. 5] has them in
// eqs. 5 to 9.
//
// The P neighbours of a pixel stand at (R cos(2 pi p / P), R sin(2 pi p / P)) from it. Bit p is 1 where the neighbour
// is at least as bright as the centre (eqs. 5, 6). A pattern with at most two changes from bit to bit round the circle
// (eq. 9) is labelled by its number of ones, all others share the label P + 1 (eq. 8).

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

inline constexpr int kFewestNeighbours = 4;        ///< P of a circle: at least so many
inline constexpr int kMostNeighbours = 24;         ///< and at most so many
inline constexpr double kLargestLbpRadius = 16.0;  ///< px; the pyramid reaches further for less

/// The circle of neighbours; the thesis uses (16, 2) and (8, 1).
struct LbpCircle {
  int neighbours = 16;     ///< P, from 4 to 24
  double radius_px = 2.0;  ///< R, from 1 to 16

  bool operator==(const LbpCircle&) const = default;
};

/// @throws Error for a circle that isn't within the limits above
void check(const LbpCircle& circle);

/// Pixels at each border that have no label, since their circle would leave the image.
int lbp_margin(const LbpCircle& circle);

/// The label, 0 to P + 1, of each pixel that has its whole circle: CV_8UC1, smaller than `gray` by the margin on all
/// sides. Between pixels brightness is bilinear, looked up to 1/256 px, and all sums are exact: so flat parts have all
/// bits set, brightness may be shifted by any amount or multiplied by any whole number, and where P is a multiple of 4
/// a turn of the image by 90 degrees turns the labels. At integer offsets only (P = 4) any increasing change of
/// brightness leaves them as they are.
/// @param gray CV_8UC1
/// @throws Error if it's of another kind, or too small to have a label
cv::Mat lbp_labels(const cv::Mat& gray, const LbpCircle& circle);

/// How often each of the P + 2 labels occurs. @throws Error as lbp_labels
std::vector<std::uint32_t> lbp_histogram(const cv::Mat& gray, const LbpCircle& circle);

}  // namespace touchstone::sensors
