#pragma once
// Pictures of a fingertip's dots with a known motion, as a chip of 18x18 pixels takes them.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/random.h"
#include "sensors/reflex/dots_motion.h"
#include "sensors/reflex/dots_picture.h"

namespace touchstone::sensors::fixtures {

/// Lengths in pixels at rest: with 0.65 mm a pixel, dots 1 mm wide and about 2 mm apart.
struct FingertipPainter {
  double spacing_px = 3.1, jitter_px = 0.6, radius_px = 0.77, edge_px = 0.5;
  double ground = 8.0, dot = 34.0;  ///< light of skin and dots
  double vignetting = 0.25;         ///< light lost in the corners
  double gain = 1.0;
  double noise = 0.0;  ///< standard deviation, steps
  int side = 18;
  std::uint64_t seed = 1;
  std::vector<int> missing = {};  ///< dots, counted from the middle outwards, that have come off
  double far_px = 16.0;           ///< dots lie within this of the middle

  std::vector<Eigen::Vector2d> dots() const {
    RandomStream random(seed, 0, Purpose::kTest);
    std::vector<Eigen::Vector2d> places;
    for (double y = -far_px; y <= far_px; y += spacing_px) {
      for (double x = -far_px; x <= far_px; x += spacing_px) {
        const double dx = jitter_px * (2.0 * random.uniform() - 1.0), dy = jitter_px * (2.0 * random.uniform() - 1.0);
        places.emplace_back(x + dx, y + dy);
      }
    }
    std::sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.norm() < b.norm(); });
    for (std::size_t i = missing.size(); i-- > 0;) places.erase(places.begin() + missing[i]);
    return places;
  }

  /// Light that falls on a pixel, before noise and steps.
  double light(const std::vector<Eigen::Vector2d>& places, const DotsMotion& motion, int row, int column) const {
    constexpr int kFine = 4;
    double sum = 0.0;
    for (int v = 0; v < kFine; ++v) {
      for (int u = 0; u < kFine; ++u) {
        const Eigen::Vector2d at(column - 0.5 * side + (u + 0.5) / kFine, row - 0.5 * side + (v + 0.5) / kFine);
        const Eigen::Vector2d on_skin = (at - motion.shift_px) / motion.dilation;
        double covered = 0.0;
        for (const Eigen::Vector2d& place : places) {
          const double reach = radius_px + 0.5 * edge_px;
          if ((on_skin - place).squaredNorm() > reach * reach) continue;
          const double inside = (radius_px - (on_skin - place).norm()) / edge_px + 0.5;
          covered = std::max(covered, std::clamp(inside, 0.0, 1.0));
        }
        const double shade = 1.0 - vignetting * at.squaredNorm() / (0.5 * side * side);
        sum += shade * (ground + (dot - ground) * covered);
      }
    }
    return gain * sum / (kFine * kFine);
  }

  /// `index` draws the noise. With times each pixel shows the motion at its own time after the first's.
  template <typename MotionAt>
  cv::Mat paint(const MotionAt& motion_at, const PixelTimes& times, std::uint64_t index) const {
    const std::vector<Eigen::Vector2d> places = dots();
    RandomStream random(seed, 1 + index, Purpose::kTest);
    cv::Mat picture(side, side, CV_8UC1);
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        const double after_s = times.empty() ? 0.0 : static_cast<double>(times.at<float>(row, column));
        const double value = light(places, motion_at(after_s), row, column) + noise * random.normal();
        picture.at<unsigned char>(row, column) = static_cast<unsigned char>(std::clamp(std::round(value), 0.0, 63.0));
      }
    }
    return picture;
  }
  cv::Mat paint(const DotsMotion& motion, std::uint64_t index = 0) const {
    return paint([&](double) { return motion; }, {}, index);
  }
};

/// The dilation when a skin that rests `distance_mm` away comes nearer by `press_mm`.
inline double dilation_of(double press_mm, double distance_mm = 16.0) {
  return distance_mm / (distance_mm - press_mm);
}

}  // namespace touchstone::sensors::fixtures
