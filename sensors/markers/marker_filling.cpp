#include "sensors/markers/marker_filling.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

constexpr double kFillRadius = 0.8;  ///< of a marker's diameter
constexpr double kRing = 2.0;        ///< its outer radius, in radii
constexpr int kLeastRing_px = 12;    ///< for a plane

/// Calls use(x, y, distance) for the pixels of the picture whose centres are within `reach` of a place.
template <typename Use>
void for_disc(const cv::Mat& picture, const Eigen::Vector2d& place, double reach, Use&& use) {
  const int top = std::max(static_cast<int>(std::floor(place.y() - reach)), 0);
  const int bottom = std::min(static_cast<int>(std::ceil(place.y() + reach)), picture.rows);
  const int left = std::max(static_cast<int>(std::floor(place.x() - reach)), 0);
  const int right = std::min(static_cast<int>(std::ceil(place.x() + reach)), picture.cols);
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const double distance = std::hypot(x + 0.5 - place.x(), y + 0.5 - place.y());
      if (distance <= reach) use(x, y, distance);
    }
  }
}

void fill_marker(cv::Mat& picture, const Eigen::Vector2d& place, double radius_px) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d right = Eigen::Matrix3d::Zero();  // a column a channel
  int count = 0;
  const auto terms_at = [&](int x, int y) { return Eigen::Vector3d(1.0, x + 0.5 - place.x(), y + 0.5 - place.y()); };
  for_disc(picture, place, kRing * radius_px, [&](int x, int y, double distance) {
    if (distance <= radius_px) return;
    const cv::Vec3b& pixel = picture.at<cv::Vec3b>(y, x);
    const Eigen::Vector3d terms = terms_at(x, y);
    normal += terms * terms.transpose();
    right += terms * Eigen::RowVector3d(pixel[0], pixel[1], pixel[2]);
    ++count;
  });
  if (count == 0) return;
  Eigen::Matrix3d plane = Eigen::Matrix3d::Zero();
  plane.row(0) = right.row(0) / count;
  if (count >= kLeastRing_px) {
    const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
    if (factor.vectorD().minCoeff() > 1e-6 * factor.vectorD().maxCoeff()) plane = factor.solve(right);
  }
  for_disc(picture, place, radius_px, [&](int x, int y, double) {
    const Eigen::RowVector3d value = terms_at(x, y).transpose() * plane;
    for (int channel = 0; channel < 3; ++channel) {
      picture.at<cv::Vec3b>(y, x)[channel] = cv::saturate_cast<std::uint8_t>(std::lround(value[channel]));
    }
  });
}

}  // namespace

void fill_markers(cv::Mat& picture, std::span<const Eigen::Vector2d> places, double radius_px) {
  if (picture.empty() || picture.type() != CV_8UC3) fail("fill markers: a BGR picture of 8 bit is needed");
  if (!(radius_px >= 1.0) || !std::isfinite(radius_px))
    fail("fill markers: radius_px is {}, at least 1 is needed", radius_px);
  for (const Eigen::Vector2d& place : places) {
    if (place.allFinite()) fill_marker(picture, place, radius_px);
  }
}

double fill_radius_px(double diameter_px) {
  return std::max(kFillRadius * diameter_px, 1.0);
}

}  // namespace touchstone::sensors
