#include "sensors/heights/rest_follower.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/wide_clones.h"

namespace touchstone::sensors {
namespace {

constexpr int kSide = 8;          // pixels of a block
constexpr int kMostOfASpeck = 2;  // blocks side by side that differ for dirt or hot pixels, where there's no contact

/// The pixels of a block, fewer at the picture's border.
cv::Rect pixels_of(int column, int row, const cv::Size& size) {
  const cv::Rect whole(kSide * column, kSide * row, kSide, kSide);
  return whole & cv::Rect({0, 0}, size);
}

/// Adds a row of pixels to the sums of its blocks.
TS_WIDE_CLONES void add_blocks(const unsigned char* row, int count, int* sums) {
  const int whole = count / kSide;
  for (int k = 0; k < whole; ++k) {
    int sum = 0;
    for (int i = 0; i < kSide; ++i) sum += row[kSide * k + i];
    sums[k] += sum;
  }
  for (int u = kSide * whole; u < count; ++u) sums[whole] += row[u];
}

}  // namespace

RestFollower::RestFollower(const cv::Mat& mean, double mm_per_px, const FollowSettings& settings)
    : settings_(settings) {
  const cv::Size size = mean.size();
  const auto check = [](const char* name, double value) {
    if (!(value >= 0.0) || std::isinf(value))
      fail("rest follower: {} is {}; allowed are numbers from 0 on", name, value);
  };
  check("frames", settings.frames);
  check("still_DN", settings.still_DN);
  check("reach_mm", settings.reach_mm);
  const cv::Size blocks((size.width + kSide - 1) / kSide, (size.height + kSide - 1) / kSide);
  // A disc that is wider than the picture reaches all of it.
  const double reach = std::min(settings.reach_mm / (mm_per_px * kSide), std::hypot(blocks.width, blocks.height));
  const int radius = static_cast<int>(std::ceil(reach));
  disc_ = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1});
  moved_.create(blocks, CV_8UC1);
  slopes_.create(blocks, CV_8UC1);
  near_.create(blocks, CV_8UC1);
  rest_.resize(moved_.total());
  sums_.resize(static_cast<std::size_t>(blocks.width));
  take(mean);
}

void RestFollower::take(const cv::Mat& mean) {
  std::fill(rest_.begin(), rest_.end(), cv::Vec3f());
  for (int v = 0; v < mean.rows; ++v) {
    const auto* const row = mean.ptr<cv::Vec3f>(v);
    cv::Vec3f* const blocks = &rest_[static_cast<std::size_t>(v / kSide * moved_.cols)];
    for (int u = 0; u < mean.cols; ++u) blocks[u / kSide] += row[u];
  }
}

double RestFollower::look(const cv::Mat (&planes)[3], const cv::Vec3d& gain) {
  moved_.setTo(0);
  for (int row = 0; row < moved_.rows; ++row) {
    for (int c = 0; c < 3; ++c) {
      const cv::Mat& plane = planes[c];
      std::fill(sums_.begin(), sums_.end(), 0);
      const int below = std::min(kSide * (row + 1), plane.rows);
      for (int v = kSide * row; v < below; ++v) add_blocks(plane.ptr(v), plane.cols, sums_.data());
      const auto share = static_cast<float>(1.0 / gain[c]);
      const cv::Vec3f* const rest = &rest_[static_cast<std::size_t>(row * moved_.cols)];
      for (int column = 0; column < moved_.cols; ++column) {
        const auto area = static_cast<float>(pixels_of(column, row, plane.size()).area());
        const float off = static_cast<float>(sums_[static_cast<std::size_t>(column)]) * share - rest[column][c];
        if (std::abs(off) > settings_.still_DN * area) moved_.at<unsigned char>(row, column) = 255;
      }
    }
  }
  return 1.0 - static_cast<double>(cv::countNonZero(moved_)) / static_cast<double>(moved_.total());
}

void RestFollower::follow(const cv::Mat& frame, const cv::Vec3d& gain, const cv::Mat& contact, cv::Mat& mean) {
  if (settings_.frames == 0.0) return;
  const cv::Rect all({0, 0}, moved_.size());
  for (int row = 0; row < moved_.rows; ++row) {
    for (int column = 0; column < moved_.cols; ++column) {
      const bool touched = cv::countNonZero(contact(pixels_of(column, row, frame.size()))) > 0;
      const bool moved = moved_.at<unsigned char>(row, column) != 0 &&
                         cv::countNonZero(moved_(cv::Rect(column - 1, row - 1, 3, 3) & all)) > kMostOfASpeck;
      slopes_.at<unsigned char>(row, column) = touched || moved ? 255 : 0;
    }
  }
  cv::dilate(slopes_, near_, disc_);
  const auto part = static_cast<float>(1.0 / std::max(1.0, settings_.frames));
  const float share[] = {static_cast<float>(part / gain[0]), static_cast<float>(part / gain[1]),
                         static_cast<float>(part / gain[2])};
  for (int row = 0; row < moved_.rows; ++row) {
    for (int column = 0; column < moved_.cols; ++column) {
      if (near_.at<unsigned char>(row, column) != 0) continue;
      const cv::Rect here = pixels_of(column, row, frame.size());
      for (int v = here.y; v < here.y + here.height; ++v) {
        const unsigned char* const seen = frame.ptr(v) + 3 * here.x;
        float* const rest = mean.ptr<float>(v) + 3 * here.x;
        for (int i = 0; i < 3 * here.width; i += 3) {
          for (int c = 0; c < 3; ++c) rest[i + c] += static_cast<float>(seen[i + c]) * share[c] - part * rest[i + c];
        }
      }
    }
  }
}

}  // namespace touchstone::sensors
