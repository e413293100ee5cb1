#pragma once
// A small binary image as rows of bits: opening, closing and connected regions of a window round one bead cost a few
// machine words a row, and no memory.

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace touchstone::sensors {

/// A binary image of at most 64 x 64 pixels. Bit x of row y is pixel (x, y); bits outside are 0.
struct BitWindow {
  static constexpr int kMaxSide = 64;

  int width = 0;
  int height = 0;
  std::array<std::uint64_t, kMaxSide> rows;  ///< the first `height` are in use

  /// A row with all of its `width` bits set.
  std::uint64_t full_row() const { return width == kMaxSide ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1; }
  bool at(int x, int y) const { return ((rows[static_cast<std::size_t>(y)] >> x) & 1u) != 0; }
};

/// Erosion and dilation by a square of side 2 radius + 1. What is outside the image has no say, as in OpenCV's
/// default for morphology.
void erode(BitWindow& window, int radius);
/// The set pixels grow by the square.
void dilate(BitWindow& window, int radius);
/// Erosion then dilation: removes what is thinner than the square.
void open_regions(BitWindow& window, int radius);
/// Dilation then erosion: closes gaps that are thinner than the square.
void close_regions(BitWindow& window, int radius);

/// Moves one connected region (8 neighbours) out of `window` into `region`: the one that holds the first set pixel in
/// row order. Returns false, with `region` undefined, if no pixel is set.
bool take_region(BitWindow& window, BitWindow& region);

/// Size and shape of a region; coordinates in px of the window, pixel centres at + 0.5.
struct RegionMoments {
  int area = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  /// Ratio of the principal second moments, at least 1 (1 for a disc; pixels count as squares, so always finite).
  double elongation = 1.0;
};
/// @pre a pixel is set
RegionMoments moments_of(const BitWindow& region);

}  // namespace touchstone::sensors
