#include "sensors/markers/gel_brightness.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace touchstone::sensors {

namespace {

constexpr double kBlock = 1.0 / 5.0;  ///< of a marker's diameter
constexpr double kReach = 0.8;        ///< half the square's side, of the diameter: a stretched marker doesn't fill it
constexpr double kBlur_px = 2.0;      ///< and a rim

struct Larger {
  std::uint8_t operator()(std::uint8_t a, std::uint8_t b) const { return std::max(a, b); }
};
struct Smaller {
  std::uint8_t operator()(std::uint8_t a, std::uint8_t b) const { return std::min(a, b); }
};

/// Of each block the extreme over `reach` to the left and the right, as far as the row goes.
template <typename Better>
void along_rows(const std::vector<std::uint8_t>& from, std::vector<std::uint8_t>& to, int columns, int rows, int reach,
                Better better) {
  std::copy(from.begin(), from.end(), to.begin());
  for (int y = 0; y < rows; ++y) {
    const std::uint8_t* in = from.data() + static_cast<std::ptrdiff_t>(y) * columns;
    std::uint8_t* out = to.data() + static_cast<std::ptrdiff_t>(y) * columns;
    for (int shift = 1; shift <= std::min(reach, columns - 1); ++shift) {
      for (int x = 0; x < columns - shift; ++x) out[x] = better(out[x], in[x + shift]);
      for (int x = shift; x < columns; ++x) out[x] = better(out[x], in[x - shift]);
    }
  }
}

/// The same upwards and downwards.
template <typename Better>
void along_columns(const std::vector<std::uint8_t>& from, std::vector<std::uint8_t>& to, int columns, int rows,
                   int reach, Better better) {
  std::copy(from.begin(), from.end(), to.begin());
  for (int y = 0; y < rows; ++y) {
    std::uint8_t* out = to.data() + static_cast<std::ptrdiff_t>(y) * columns;
    for (int v = std::max(y - reach, 0); v <= std::min(y + reach, rows - 1); ++v) {
      const std::uint8_t* in = from.data() + static_cast<std::ptrdiff_t>(v) * columns;
      for (int x = 0; x < columns; ++x) out[x] = better(out[x], in[x]);
    }
  }
}

}  // namespace

void GelBrightness::read(const cv::Mat& brightness, double diameter_px) {
  block_px_ = std::max(static_cast<int>(kBlock * diameter_px), 1);
  columns_ = (brightness.cols + block_px_ - 1) / block_px_;
  rows_ = (brightness.rows + block_px_ - 1) / block_px_;
  const std::size_t blocks = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  closed_.resize(blocks);
  between_.resize(blocks);
  sum_.resize(static_cast<std::size_t>(brightness.cols));
  for (int row = 0; row < rows_; ++row) {
    std::fill(sum_.begin(), sum_.end(), 0U);
    const int top = row * block_px_;
    const int bottom = std::min(top + block_px_, brightness.rows);
    for (int y = top; y < bottom; ++y) {
      const std::uint8_t* in = brightness.ptr<std::uint8_t>(y);
      std::uint32_t* sum = sum_.data();
      for (int x = 0; x < brightness.cols; ++x) sum[x] += in[x];
    }
    std::uint8_t* out = closed_.data() + static_cast<std::ptrdiff_t>(row) * columns_;
    for (int column = 0; column < columns_; ++column) {
      const int width = std::min(block_px_, brightness.cols - column * block_px_);
      const auto pixels = static_cast<std::uint32_t>(width * (bottom - top));
      const auto first = sum_.begin() + static_cast<std::ptrdiff_t>(column) * block_px_;
      const std::uint32_t sum = std::accumulate(first, first + width, pixels / 2);
      out[column] = static_cast<std::uint8_t>(sum / pixels);
    }
  }
  const int reach = static_cast<int>(std::ceil((kReach * diameter_px + kBlur_px) / block_px_));
  along_rows(closed_, between_, columns_, rows_, reach, Larger());
  along_columns(between_, closed_, columns_, rows_, reach, Larger());
  along_rows(closed_, between_, columns_, rows_, reach, Smaller());
  along_columns(between_, closed_, columns_, rows_, reach, Smaller());
}

}  // namespace touchstone::sensors
