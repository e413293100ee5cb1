#include "render/imager/motion_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::render {
namespace {

constexpr int kSide = 2 * kMatchReach + 1;
constexpr int kLeastSize = kSide + 2;

/// Sum of squared differences of the middle of `now` and of `before` moved by (x, y).
int squared_differences(const cv::Mat& now, const cv::Mat& before, int x, int y) {
  int sum = 0;
  for (int row = kMatchReach; row < now.rows - kMatchReach; ++row) {
    const unsigned char* here = now.ptr<unsigned char>(row);
    const unsigned char* there = before.ptr<unsigned char>(row - y) - x;
    for (int column = kMatchReach; column < now.cols - kMatchReach; ++column) {
      const int difference = here[column] - there[column];
      sum += difference * difference;
    }
  }
  return sum;
}

struct Lowest {
  double place = 0.0;
  double depth = 0.0;  // below the middle value
};

/// Of the parabola through three values at -1, 0 and 1, the middle one being the least.
Lowest lowest_of(double left, double middle, double right) {
  const double bend = left - 2.0 * middle + right;
  if (bend <= 0.0) return {};
  const double slope = left - right;
  return {0.5 * slope / bend, 0.125 * slope * slope / bend};
}

double variance_of(const cv::Mat& picture) {
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(picture, mean, deviation);
  return deviation[0] * deviation[0];
}

}  // namespace

MotionMatch match_motion(const cv::Mat& now, const cv::Mat& before) {
  for (const cv::Mat* picture : {&now, &before}) {
    if (picture->type() != CV_8UC1 || picture->rows < kLeastSize || picture->cols < kLeastSize) {
      fail("motion is matched in grey pictures of 8 bit numbers, at least {0}x{0}; this is {1}x{2} of OpenCV type {3}",
           kLeastSize, picture->cols, picture->rows, picture->type());
    }
  }
  if (now.size() != before.size()) {
    fail("motion is matched between pictures of one size; these are {}x{} and {}x{}", now.cols, now.rows, before.cols,
         before.rows);
  }
  std::array<std::array<int, kSide>, kSide> sums{};
  int best_x = 0;
  int best_y = 0;
  const auto sum_at = [&sums](int x, int y) -> int& { return sums[y + kMatchReach][x + kMatchReach]; };
  for (int y = -kMatchReach; y <= kMatchReach; ++y) {
    for (int x = -kMatchReach; x <= kMatchReach; ++x) sum_at(x, y) = squared_differences(now, before, x, y);
  }
  // Of equal sums the nearest to no motion.
  for (int y = -kMatchReach; y <= kMatchReach; ++y) {
    for (int x = -kMatchReach; x <= kMatchReach; ++x) {
      const int here = sum_at(x, y);
      const int best = sum_at(best_x, best_y);
      if (here < best || (here == best && x * x + y * y < best_x * best_x + best_y * best_y)) {
        best_x = x;
        best_y = y;
      }
    }
  }
  Lowest along_x;
  Lowest along_y;
  if (std::abs(best_x) < kMatchReach) {
    along_x = lowest_of(sum_at(best_x - 1, best_y), sum_at(best_x, best_y), sum_at(best_x + 1, best_y));
  }
  if (std::abs(best_y) < kMatchReach) {
    along_y = lowest_of(sum_at(best_x, best_y - 1), sum_at(best_x, best_y), sum_at(best_x, best_y + 1));
  }
  const int pixels = (now.rows - 2 * kMatchReach) * (now.cols - 2 * kMatchReach);
  MotionMatch match;
  match.shift = {best_x + along_x.place, best_y + along_y.place};
  match.difference = std::max(0.0, sum_at(best_x, best_y) - along_x.depth - along_y.depth) / pixels;
  return match;
}

Eigen::Vector2i MotionCounter::count(const cv::Mat& frame, int features) {
  const auto start_from = [&](const Eigen::Vector2d& left_over) {
    frame.copyTo(reference_);
    left_over_ = left_over;
  };
  if (reference_.empty() || features < kLeastFeatures) {
    start_from(Eigen::Vector2d::Zero());
    return Eigen::Vector2i::Zero();
  }
  const MotionMatch match = match_motion(frame, reference_);
  const Eigen::Vector2d moved = left_over_ + match.shift;
  const Eigen::Vector2d whole(std::trunc(moved.x()), std::trunc(moved.y()));
  const bool stale = match.difference > kStaleDifference && match.difference > kStaleShare * variance_of(frame);
  if (!whole.isZero(0.0) || stale) start_from(moved - whole);
  return whole.cast<int>();
}

}  // namespace touchstone::render
