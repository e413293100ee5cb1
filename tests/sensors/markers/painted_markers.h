#pragma once
// Pictures of a gel's markers with known positions, made by a formula: discs with blurred rims on a membrane that three
// lamps of different colours shade from three sides; black ones on a bright membrane, or bright ones on a black one.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/random.h"

namespace touchstone::sensors::fixtures {

struct MarkerPicture {
  int width = 320;
  int height = 240;
  double diameter_px = 7.5;
  double blur_px = 0.7;          ///< standard deviation of the rim's blur
  double diameter_spread = 0.0;  ///< each marker's diameter is changed by up to this part
  double marker = 0.08;          ///< albedo of a marker against the membrane's; above 1: bright markers
  double brightness = 150.0;     ///< in the middle, grey levels
  double shading = 0.3;          ///< how much a channel falls off over the picture's half width
  double vignette = 0.0;         ///< how much darker the corners are
  double noise = 0.0;            ///< standard deviation, grey levels
  cv::Rect shadow = {};          ///< where the membrane has only
  double shadow_light = 0.4;     ///< this part of its light
};

/// A grid of markers in rows, as far as whole ones fit with some distance from the edge.
inline std::vector<Eigen::Vector2d> marker_grid(double spacing_px = 22.6, int width = 320, int height = 240) {
  std::vector<Eigen::Vector2d> places;
  for (double y = 12.3; y < height - 8; y += spacing_px) {
    for (double x = 11.6; x < width - 8; x += spacing_px) places.emplace_back(x, y);
  }
  return places;
}

/// A place that isn't finite is left out. A marker's diameter goes with its number.
inline cv::Mat paint_markers(const MarkerPicture& picture, const std::vector<Eigen::Vector2d>& places,
                             std::uint64_t seed = 1) {
  cv::Mat_<double> cover(picture.height, picture.width, 0.0);
  RandomStream sizes(7, 0, Purpose::kTest);
  for (const Eigen::Vector2d& place : places) {
    const double radius = 0.5 * picture.diameter_px * (1.0 + picture.diameter_spread * (2.0 * sizes.uniform() - 1.0));
    if (!place.allFinite()) continue;
    const double reach = radius + 4.0 * picture.blur_px + 1.0;
    for (int y = std::max(0, static_cast<int>(place.y() - reach));
         y < std::min<double>(picture.height, place.y() + reach); ++y) {
      for (int x = std::max(0, static_cast<int>(place.x() - reach));
           x < std::min<double>(picture.width, place.x() + reach); ++x) {
        const double distance = std::hypot(x + 0.5 - place.x(), y + 0.5 - place.y());
        const double here = 0.5 * std::erfc((distance - radius) / (std::sqrt(2.0) * picture.blur_px));
        cover(y, x) = std::max(cover(y, x), here);
      }
    }
  }
  RandomStream random(seed, 0, Purpose::kTest);
  cv::Mat image(picture.height, picture.width, CV_8UC3);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const double u = (x + 0.5) / (0.5 * picture.width) - 1.0;
      const double v = (y + 0.5) / (0.5 * picture.height) - 1.0;
      const double light = (picture.shadow.contains({x, y}) ? picture.shadow_light : 1.0) *
                           (1.0 - 0.5 * picture.vignette * (u * u + v * v));
      for (int channel = 0; channel < 3; ++channel) {
        const double angle = 2.0943951023931953 * channel;
        const double shade = 1.0 + picture.shading * (std::cos(angle) * u + std::sin(angle) * v);
        const double albedo = 1.0 - (1.0 - picture.marker) * cover(y, x);
        double value = picture.brightness * light * shade * albedo;
        if (picture.noise > 0) value += picture.noise * random.normal();
        image.at<cv::Vec3b>(y, x)[channel] = static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
      }
    }
  }
  return image;
}

}  // namespace touchstone::sensors::fixtures
