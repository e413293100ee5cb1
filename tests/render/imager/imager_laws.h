#pragma once
// What holds for every imager, binned or not.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <opencv2/core.hpp>

#include "render/imager/imager.h"

namespace touchstone::render {

inline bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

/// Of an imager of three bands. The light rises by `step`, W/m^2, from row to row in one band and from column to column
/// in another, beside an even third.
inline void expect_same_bytes_on_any_threads(const Imager& imager, float step, float even) {
  cv::Mat light(97, 61, CV_32FC3);
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.cols; ++column) {
      light.at<cv::Vec3f>(row, column) = {step * static_cast<float>(row), even, step * static_cast<float>(column)};
    }
  }
  cv::Mat one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = expose(light, imager, 3, 9);
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 4);
  EXPECT_TRUE(same_bytes(one, expose(light, imager, 3, 9)));
  EXPECT_FALSE(same_bytes(one, expose(light, imager, 3, 10)));
  EXPECT_FALSE(same_bytes(one, expose(light, imager, 4, 9)));
}

}  // namespace touchstone::render
