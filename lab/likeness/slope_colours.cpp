#include "lab/likeness/slope_colours.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kSteepest = 3.0;
constexpr double kCell = 0.1;
constexpr int kSide = static_cast<int>(2 * kSteepest / kCell + 0.5) + 1;
constexpr double kWidestFill = 32.0;  // cells: the standard deviation of the last filling
constexpr double kEnough = 0.5;       // pixels, by their weight

/// In cells, from the table's first.
double place_of(float slope) {
  return std::clamp((slope + kSteepest) / kCell, 0.0, kSide - 1.0);
}

}  // namespace

cv::Mat slopes_of(const cv::Mat& height, double mm_per_px) {
  TS_ASSERT(height.type() == CV_32FC1 && mm_per_px > 0.0);
  const auto at = [&](int v, int u) {
    const float h = height.at<float>(std::clamp(v, 0, height.rows - 1), std::clamp(u, 0, height.cols - 1));
    return std::isfinite(h) ? h : 0.0f;
  };
  const auto scale = static_cast<float>(0.5 / mm_per_px);
  cv::Mat slopes(height.size(), CV_32FC2);
  for (int v = 0; v < height.rows; ++v) {
    for (int u = 0; u < height.cols; ++u) {
      slopes.at<cv::Vec2f>(v, u) = {scale * (at(v, u + 1) - at(v, u - 1)), scale * (at(v + 1, u) - at(v - 1, u))};
    }
  }
  return slopes;
}

SlopeColours::SlopeColours() : sum_(kSide, kSide, CV_64FC3, cv::Scalar::all(0)), count_(kSide, kSide, CV_64F, 0.0) {}

void SlopeColours::learn(const cv::Mat& slopes, const cv::Mat& difference) {
  TS_ASSERT(slopes.type() == CV_32FC2 && difference.type() == CV_32FC3 && slopes.size() == difference.size());
  for (int v = 0; v < slopes.rows; ++v) {
    for (int u = 0; u < slopes.cols; ++u) {
      const cv::Vec2f slope = slopes.at<cv::Vec2f>(v, u);
      const int column = cvRound(place_of(slope[0])), row = cvRound(place_of(slope[1]));
      sum_.at<cv::Vec3d>(row, column) += cv::Vec3d(difference.at<cv::Vec3f>(v, u));
      count_.at<double>(row, column) += 1.0;
    }
  }
}

void SlopeColours::finish() {
  mean_ = cv::Mat(kSide, kSide, CV_32FC3, cv::Scalar::all(0));
  cv::Mat missing(kSide, kSide, CV_8U, cv::Scalar(255));
  cv::Mat sum = sum_, count = count_;
  for (double width = 0.5; width <= kWidestFill; width *= 2) {
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) {
        const double pixels = count.at<double>(row, column);
        if (missing.at<std::uint8_t>(row, column) == 0 || pixels < kEnough) continue;
        mean_.at<cv::Vec3f>(row, column) = cv::Vec3f(sum.at<cv::Vec3d>(row, column) / pixels);
        missing.at<std::uint8_t>(row, column) = 0;
      }
    }
    cv::GaussianBlur(sum_, sum, {0, 0}, width, width, cv::BORDER_CONSTANT);
    cv::GaussianBlur(count_, count, {0, 0}, width, width, cv::BORDER_CONSTANT);
  }
}

cv::Mat SlopeColours::colours(const cv::Mat& slopes) const {
  TS_ASSERT(slopes.type() == CV_32FC2 && !mean_.empty());
  cv::Mat column(slopes.size(), CV_32F), row(slopes.size(), CV_32F);
  for (int v = 0; v < slopes.rows; ++v) {
    for (int u = 0; u < slopes.cols; ++u) {
      const cv::Vec2f slope = slopes.at<cv::Vec2f>(v, u);
      column.at<float>(v, u) = static_cast<float>(place_of(slope[0]));
      row.at<float>(v, u) = static_cast<float>(place_of(slope[1]));
    }
  }
  cv::Mat out;
  cv::remap(mean_, out, column, row, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

}  // namespace touchstone::lab
