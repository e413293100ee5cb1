#include "sensors/heights/height_map.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/wide_clones.h"

namespace touchstone::sensors {
namespace {

TS_WIDE_CLONES int mark_above(const float* heights, float limit, int count, unsigned char* mask) {
  int above = 0;
  for (int u = 0; u < count; ++u) {
    const bool contact = heights[u] > limit;
    mask[u] = contact ? 255 : 0;
    above += contact ? 1 : 0;
  }
  return above;
}

/// The largest of each of eight columns, so that rows need no order.
TS_WIDE_CLONES float largest_of(const float* values, int count, float largest) {
  constexpr int kColumns = 8;
  float columns[kColumns];
  std::fill(columns, columns + kColumns, largest);
  int i = 0;
  for (; i + kColumns <= count; i += kColumns) {
    for (int k = 0; k < kColumns; ++k) columns[k] = values[i + k] > columns[k] ? values[i + k] : columns[k];
  }
  for (; i < count; ++i) columns[0] = std::max(columns[0], values[i]);
  return *std::max_element(columns, columns + kColumns);
}

}  // namespace

Eigen::Vector3d normal_of(const Eigen::Vector2d& slope) {
  return Eigen::Vector3d(-slope.x(), -slope.y(), 1.0) / std::sqrt(1.0 + slope.squaredNorm());
}

int mark_contact(const cv::Mat& heights_mm, const ContactRule& rule, cv::Mat& mask) {
  TS_ASSERT(heights_mm.type() == CV_32FC1 && !heights_mm.empty());
  float highest = heights_mm.at<float>(0, 0);
  for (int v = 0; v < heights_mm.rows; ++v) highest = largest_of(heights_mm.ptr<float>(v), heights_mm.cols, highest);
  const auto limit = static_cast<float>(std::max(rule.floor_mm, rule.share * static_cast<double>(highest)));
  mask.create(heights_mm.size(), CV_8UC1);
  int pixels = 0;
  for (int v = 0; v < heights_mm.rows; ++v) {
    pixels += mark_above(heights_mm.ptr<float>(v), limit, heights_mm.cols, mask.ptr<unsigned char>(v));
  }
  return pixels;
}

bool touches_border(const cv::Mat& mask) {
  TS_ASSERT(mask.type() == CV_8UC1 && !mask.empty());
  const auto any = [](const cv::Mat& line) { return cv::countNonZero(line) > 0; };
  return any(mask.row(0)) || any(mask.row(mask.rows - 1)) || any(mask.col(0)) || any(mask.col(mask.cols - 1));
}

void level_by_border(cv::Mat& heights_mm) {
  TS_ASSERT(heights_mm.type() == CV_32FC1 && !heights_mm.empty());
  const int last_v = heights_mm.rows - 1;
  const int last_u = heights_mm.cols - 1;
  double sum = 0.0;
  int count = 0;
  for (int v = 0; v <= last_v; ++v) {
    const bool whole = v == 0 || v == last_v;
    for (int u = 0; u <= last_u; u += whole ? 1 : std::max(last_u, 1)) {
      sum += heights_mm.at<float>(v, u);
      ++count;
    }
  }
  const auto mean = static_cast<float>(sum / count);
  for (int v = 0; v <= last_v; ++v) {
    auto* const row = heights_mm.ptr<float>(v);
    for (int u = 0; u <= last_u; ++u) row[u] -= mean;
  }
}

}  // namespace touchstone::sensors
