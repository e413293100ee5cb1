#include "sensors/heights/rest_follower.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kSide = 8;          // pixels of a block
constexpr int kMostOfASpeck = 2;  // blocks side by side that differ for dirt or hot pixels, where there's no contact

/// The pixels of a block, fewer at the picture's border.
cv::Rect pixels_of(int column, int row, const cv::Size& size) {
  const cv::Rect whole(kSide * column, kSide * row, kSide, kSide);
  return whole & cv::Rect({0, 0}, size);
}

}  // namespace

RestFollower::RestFollower(const cv::Size& size, double mm_per_px, const FollowSettings& settings)
    : settings_(settings) {
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
}

double RestFollower::look(const cv::Mat& frame, const cv::Vec3d& gain, const cv::Mat& mean) {
  const float share[] = {static_cast<float>(1.0 / gain[0]), static_cast<float>(1.0 / gain[1]),
                         static_cast<float>(1.0 / gain[2])};
  for (int row = 0; row < moved_.rows; ++row) {
    for (int column = 0; column < moved_.cols; ++column) {
      const cv::Rect here = pixels_of(column, row, frame.size());
      float sums[3] = {0.0F, 0.0F, 0.0F};
      for (int v = here.y; v < here.y + here.height; ++v) {
        const unsigned char* const seen = frame.ptr(v) + 3 * here.x;
        const float* const rest = mean.ptr<float>(v) + 3 * here.x;
        for (int i = 0; i < 3 * here.width; i += 3) {
          for (int c = 0; c < 3; ++c) sums[c] += static_cast<float>(seen[i + c]) * share[c] - rest[i + c];
        }
      }
      const float most =
          std::max({std::abs(sums[0]), std::abs(sums[1]), std::abs(sums[2])}) / static_cast<float>(here.area());
      moved_.at<unsigned char>(row, column) = most > settings_.still_DN ? 255 : 0;
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
