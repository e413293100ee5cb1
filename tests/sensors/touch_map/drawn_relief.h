#pragma once
// Reliefs that are drawn, seen by a touch at a known pose: the truth of the registration's tests.

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/random.h"
#include "sensors/touch_map/planar_pose.h"
#include "sensors/touch_map/touch_image.h"

namespace touchstone::sensors::fixtures {

/// Height (mm) over points of a surface.
using Surface = std::function<double(const Eigen::Vector2d&)>;

/// Studs, short ridges and rings strewn over a square; no two squares of some mm are alike. Indented by 0.1 mm beside.
inline Surface strewn_relief(std::uint64_t seed, double half_side_mm = 12.0, int pieces = 400) {
  struct Piece {
    Eigen::Vector2d a, b;
    double radius, width, height;
  };
  RandomStream random(seed, 0, Purpose::kTest);
  const auto within = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  std::vector<Piece> list;
  for (int i = 0; i < pieces; ++i) {
    const Eigen::Vector2d a(within(-half_side_mm, half_side_mm), within(-half_side_mm, half_side_mm));
    const double angle = within(-kPi, kPi), length = i % 2 ? within(0.4, 1.8) : 0.0;
    const double ring = i % 5 ? 0.0 : within(0.4, 0.9);
    list.push_back({a, a + length * Eigen::Vector2d(std::cos(angle), std::sin(angle)), ring, within(0.1, 0.2),
                    within(0.03, 0.09)});
  }
  // Pieces by the cells of 1 mm that they reach into.
  constexpr double kReach = 3.0;  // widths
  const int side = 2 * static_cast<int>(std::ceil(half_side_mm)) + 6;
  const auto cell = [side](double x) { return std::clamp(static_cast<int>(std::floor(x)) + side / 2, 0, side - 1); };
  std::vector<std::vector<Piece>> cells(static_cast<std::size_t>(side * side));
  for (const Piece& one : list) {
    const double reach = one.radius + kReach * one.width;
    const Eigen::Vector2d low = one.a.cwiseMin(one.b).array() - reach, high = one.a.cwiseMax(one.b).array() + reach;
    for (int j = cell(low.y()); j <= cell(high.y()); ++j) {
      for (int i = cell(low.x()); i <= cell(high.x()); ++i)
        cells[static_cast<std::size_t>(j * side + i)].push_back(one);
    }
  }
  return [cells, cell, side](const Eigen::Vector2d& p) {
    double highest = 0.0;
    for (const Piece& one : cells[static_cast<std::size_t>(cell(p.y()) * side + cell(p.x()))]) {
      const Eigen::Vector2d along = one.b - one.a;
      const double length = along.squaredNorm();
      const double t = length > 0.0 ? std::clamp((p - one.a).dot(along) / length, 0.0, 1.0) : 0.0;
      const double distance = std::abs((p - one.a - t * along).norm() - one.radius) / one.width;
      if (distance < kReach) highest = std::max(highest, one.height * std::exp(-0.5 * distance * distance));
    }
    return 0.1 + highest;
  };
}

struct Camera {
  int columns = 320, rows = 240;
  double mm_per_px = 0.05;
  double noise_mm = 0.002;
};

/// What a touch sees whose frame lies on the surface as given.
inline TouchImage touch_of(const Surface& surface, const PlanarPose& surface_from_touch, std::uint64_t seed,
                           const Camera& camera = {}) {
  RandomStream random(seed, 1, Purpose::kTest);
  const PixelFrame frame = touch_frame({camera.columns, camera.rows}, camera.mm_per_px);
  cv::Mat height(camera.rows, camera.columns, CV_32FC1);
  for (int v = 0; v < camera.rows; ++v) {
    for (int u = 0; u < camera.columns; ++u) {
      height.at<float>(v, u) =
          static_cast<float>(surface(surface_from_touch * frame.point_of({u, v})) + camera.noise_mm * random.normal());
    }
  }
  return touch_by_height(height, camera.mm_per_px, 0.02);
}

}  // namespace touchstone::sensors::fixtures
