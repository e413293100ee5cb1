#include "sensors/texture/height_gray.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr double kMiddleLevel = 128.0;
constexpr double kTopLevel = 255.0;

/// All heights, row by row.
std::vector<float> checked_heights(const cv::Mat& heights_mm) {
  if (heights_mm.empty()) fail("the height image is empty");
  if (heights_mm.dims != 2 || heights_mm.type() != CV_32FC1) {
    fail("the height image has {} channels of depth {}; 1 channel of 32 bit floats is needed", heights_mm.channels(),
         heights_mm.depth());
  }
  std::vector<float> all;
  all.reserve(heights_mm.total());
  for (int j = 0; j < heights_mm.rows; ++j) {
    const auto* row = heights_mm.ptr<float>(j);
    for (int i = 0; i < heights_mm.cols; ++i) {
      if (!std::isfinite(row[i])) fail("the height at column {}, row {} is {}", i, j, row[i]);
      all.push_back(row[i]);
    }
  }
  return all;
}

}  // namespace

cv::Mat height_gray(const cv::Mat& heights_mm, double step_mm) {
  if (!(std::isfinite(step_mm) && step_mm > 0.0)) fail("a gray level is {} mm high; it must be above 0", step_mm);
  std::vector<float> all = checked_heights(heights_mm);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>((all.size() - 1) / 2);
  std::nth_element(all.begin(), middle, all.end());
  const double median = *middle;
  cv::Mat gray(heights_mm.size(), CV_8UC1);
  for (int j = 0; j < gray.rows; ++j) {
    const auto* height = heights_mm.ptr<float>(j);
    auto* level = gray.ptr<std::uint8_t>(j);
    for (int i = 0; i < gray.cols; ++i) {
      const double exact = kMiddleLevel + (static_cast<double>(height[i]) - median) / step_mm;
      level[i] = static_cast<std::uint8_t>(std::clamp(exact, 0.0, kTopLevel) + 0.5);
    }
  }
  return gray;
}

}  // namespace touchstone::sensors
