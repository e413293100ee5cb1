#include "sensors/image/gaussian_pyramid.h"

#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::sensors {

std::vector<cv::Mat> gaussian_pyramid(const cv::Mat& gray, int levels) {
  constexpr int kLeastSide = 3;  // what the kernel's mirrored border takes
  if (levels < 1 || levels > kMostPyramidLevels) {
    fail("{} pyramid levels; from 1 to {} are allowed", levels, kMostPyramidLevels);
  }
  if (gray.empty() || gray.dims != 2 || gray.type() != CV_8UC1) fail("a pyramid needs a gray image of 8 bit");
  std::vector<cv::Mat> pyramid{gray};
  for (int level = 1; level < levels; ++level) {
    const cv::Mat& finer = pyramid.back();
    if (finer.cols < kLeastSide || finer.rows < kLeastSide) {
      fail("an image of {} x {} px is too small for {} pyramid levels", gray.cols, gray.rows, levels);
    }
    cv::Mat half;
    cv::pyrDown(finer, half);
    pyramid.push_back(half);
  }
  return pyramid;
}

}  // namespace touchstone::sensors
