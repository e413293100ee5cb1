#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

/// How bright the gel is beside dark markers and under them: the picture's grey closing [Serra1982] over a square that
/// no marker fills. Unlike a mean over a window it doesn't fall beside a black housing, nor rise beside a highlight. It
/// is made of blocks of a fifth of a marker's diameter: finer it would take the noise's highest pixels. One object is
/// for one thread; for pictures of one size nothing is allocated after the first.
class GelBrightness {
 public:
  /// @param brightness CV_8UC1, not empty
  /// @param diameter_px of the markers, above 0
  void read(const cv::Mat& brightness, double diameter_px);

  /// Grey levels of the row's pixels, each block's for all of its pixels: level[x / block_px()]. @pre 0 <= y < rows
  const std::uint8_t* row(int y) const {
    return closed_.data() + static_cast<std::ptrdiff_t>(y / block_px_) * static_cast<std::ptrdiff_t>(columns_);
  }
  /// Side of a block.
  int block_px() const { return block_px_; }

 private:
  int block_px_ = 1, columns_ = 0, rows_ = 0;
  std::vector<std::uint8_t> closed_, between_;
  std::vector<std::uint32_t> sum_;  ///< over a block's rows, of each column of pixels
};

}  // namespace touchstone::sensors
