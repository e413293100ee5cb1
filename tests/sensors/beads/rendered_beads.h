#pragma once
// Pictures of beads with known positions, made by a formula: discs with blurred rims on a shaded, textured background.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/frame.h"
#include "core/random.h"

namespace touchstone::sensors::fixtures {

struct BeadPicture {
  int width = 640;
  int height = 480;
  double background = 170.0;
  double bead = 40.0;
  double radius_px = 9.0;
  double blur_px = 0.8;      ///< standard deviation of the rim's blur
  double texture = 4.0;      ///< amplitude of a fine wavy pattern, in grey levels
  double fall_off_px = 0.0;  ///< > 0: shade by cos^4 of the angle atan(distance from the centre / fall_off_px)
  double noise = 0.0;        ///< standard deviation, grey levels
};

/// Nominal positions of an n x n grid, row-major.
inline std::vector<Eigen::Vector2d> grid_positions(int n, double spacing_px, const Eigen::Vector2d& centre) {
  std::vector<Eigen::Vector2d> positions;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      positions.push_back(centre + spacing_px * Eigen::Vector2d(column - 0.5 * (n - 1), row - 0.5 * (n - 1)));
    }
  }
  return positions;
}

/// Paints pictures; keeps what doesn't change from one to the next.
class BeadPainter {
 public:
  explicit BeadPainter(const BeadPicture& picture, std::uint64_t seed = 1)
      : picture_(picture), random_(seed, 0, Purpose::kTest) {
    background_.create(picture.height, picture.width, CV_32F);
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const double dx = x + 0.5 - 0.5 * picture.width;
        const double dy = y + 0.5 - 0.5 * picture.height;
        const double cosine_squared =
            picture.fall_off_px > 0 ? 1.0 / (1.0 + (dx * dx + dy * dy) / (picture.fall_off_px * picture.fall_off_px))
                                    : 1.0;
        shade_at_.push_back(static_cast<float>(cosine_squared * cosine_squared));
        const double wave = std::sin(0.9 * x + 0.3 * y) * std::sin(0.7 * y - 0.4 * x);
        background_.at<float>(y, x) = static_cast<float>(picture.background + picture.texture * wave);
      }
    }
    if (picture.noise > 0) {  // a pool, from which each picture takes another cut
      noise_.create(picture.height + 64, picture.width + 64, CV_32F);
      for (float& value : cv::Mat_<float>(noise_)) value = static_cast<float>(picture.noise * random_.normal());
    }
  }

  /// A bead that isn't finite is left out.
  cv::Mat paint(const std::vector<Eigen::Vector2d>& beads, double gain = 1.0) {
    cv::Mat light = background_.clone();
    for (const Eigen::Vector2d& bead : beads) {
      if (bead.allFinite()) paint_bead(light, bead);
    }
    cv::Mat image(picture_.height, picture_.width, CV_8U);
    const int shift_x = picture_.noise > 0 ? static_cast<int>(random_() % 64) : 0;
    const int shift_y = picture_.noise > 0 ? static_cast<int>(random_() % 64) : 0;
    for (int y = 0; y < picture_.height; ++y) {
      const float* in = light.ptr<float>(y);
      const float* shade = shade_at_.data() + static_cast<std::ptrdiff_t>(y) * picture_.width;
      const float* noise = picture_.noise > 0 ? noise_.ptr<float>(y + shift_y) + shift_x : nullptr;
      for (int x = 0; x < picture_.width; ++x) {
        const float value = static_cast<float>(gain) * in[x] * shade[x] + (noise ? noise[x] : 0.0f);
        image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
      }
    }
    return image;
  }

 private:
  void paint_bead(cv::Mat& light, const Eigen::Vector2d& bead) const {
    const double reach = picture_.radius_px + 5.0 * picture_.blur_px + 1.0;
    const int x0 = std::max(0, static_cast<int>(bead.x() - reach));
    const int y0 = std::max(0, static_cast<int>(bead.y() - reach));
    const int x1 = std::min(picture_.width, static_cast<int>(bead.x() + reach) + 1);
    const int y1 = std::min(picture_.height, static_cast<int>(bead.y() + reach) + 1);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const double r = std::hypot(x + 0.5 - bead.x(), y + 0.5 - bead.y());
        const double cover = 0.5 * std::erfc((r - picture_.radius_px) / (std::sqrt(2.0) * picture_.blur_px));
        float& value = light.at<float>(y, x);
        value += static_cast<float>(cover * (picture_.bead - value));
      }
    }
  }

  BeadPicture picture_;
  RandomStream random_;
  cv::Mat background_;
  cv::Mat noise_;
  std::vector<float> shade_at_;
};

}  // namespace touchstone::sensors::fixtures
