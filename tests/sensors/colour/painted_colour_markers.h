#pragma once
// Pictures of coloured markers behind coloured film with known places, made by a formula: white, on it squares of
// magenta ink, and over both squares of yellow film, whose transmission multiplies what is behind. Light is linear.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/random.h"

namespace touchstone::sensors::fixtures {

struct ColourPicture {
  int width = 600;
  int height = 600;
  int columns = 10;
  int rows = 10;
  double spacing_px = 45.0;
  double marker_px = 30.0;                                       ///< side of a marker at rest
  double film_px = 30.0;                                         ///< side of a film square
  double angle = 0.0;                                            ///< of the whole sensor, radians, x towards y
  Eigen::Vector2d middle_px = Eigen::Vector2d(300.4, 299.7);     ///< where the grid's middle is
  Eigen::Vector2d film_offset_px = Eigen::Vector2d::Zero();      ///< of all films against the markers at rest
  double film_scale = 1.0;                                       ///< of the film's grid about the middle: parallax
  std::vector<Eigen::Vector2d> shift_px;                         ///< of each marker; none: zero
  std::vector<double> stretch;                                   ///< of each marker's side; 0 leaves it out; none: 1
  std::vector<std::size_t> no_film;                              ///< films that are left out
  Eigen::Vector3d ink = Eigen::Vector3d(0.70, 0.12, 0.85);       ///< part of white that ink returns: B, G, R
  Eigen::Vector3d film = Eigen::Vector3d(0.08, 0.90, 0.96);      ///< part that film lets through
  Eigen::Vector3d white = Eigen::Vector3d(190.0, 205.0, 200.0);  ///< grey levels in the middle
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  ///< relative change of light from the middle to an edge
  double blur_px = 0.7;                                ///< standard deviation
  double noise = 0.0;                                  ///< standard deviation, grey levels
  std::uint64_t seed = 1;
  int samples = 8;  ///< along a pixel's side

  std::size_t count() const { return static_cast<std::size_t>(columns * rows); }
  Eigen::Matrix2d turn() const {
    Eigen::Matrix2d matrix;
    matrix << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    return matrix;
  }
  /// Where marker i is at rest, px.
  Eigen::Vector2d rest(std::size_t i) const {
    const auto column = static_cast<double>(i % static_cast<std::size_t>(columns));
    const auto row = static_cast<double>(i / static_cast<std::size_t>(columns));
    return middle_px + turn() * (spacing_px * Eigen::Vector2d(column - 0.5 * (columns - 1), row - 0.5 * (rows - 1)));
  }
  Eigen::Vector2d place(std::size_t i) const {
    return rest(i) + (shift_px.empty() ? Eigen::Vector2d::Zero() : shift_px[i]);
  }
  Eigen::Vector2d film_place(std::size_t i) const {
    return middle_px + film_scale * (rest(i) - middle_px) + film_offset_px;
  }
};

/// The picture before noise and rounding, CV_32FC3, grey levels, not clipped.
inline cv::Mat paint_colour_light(const ColourPicture& picture) {
  const int fine = picture.samples;
  cv::Mat layers(picture.height * fine, picture.width * fine, CV_8U, cv::Scalar(0));
  const Eigen::Matrix2d back = picture.turn().transpose();
  const auto add_square = [&](const Eigen::Vector2d& middle, double side, int bit) {
    const double reach = 0.75 * side + 1.0;
    const auto first = [&](double at) { return std::max(0, static_cast<int>((at - reach) * fine)); };
    const auto last = [&](double at, int size) { return std::min(size * fine, static_cast<int>((at + reach) * fine)); };
    for (int y = first(middle.y()); y < last(middle.y(), picture.height); ++y) {
      for (int x = first(middle.x()); x < last(middle.x(), picture.width); ++x) {
        const Eigen::Vector2d here = back * (Eigen::Vector2d(x + 0.5, y + 0.5) / fine - middle);
        if (here.cwiseAbs().maxCoeff() <= 0.5 * side) {
          auto& pixel = layers.at<std::uint8_t>(y, x);
          pixel = static_cast<std::uint8_t>(pixel | bit);
        }
      }
    }
  };
  for (std::size_t i = 0; i < picture.count(); ++i) {
    const double side = picture.marker_px * (picture.stretch.empty() ? 1.0 : picture.stretch[i]);
    if (side > 0.0) add_square(picture.place(i), side, 1);
    if (std::find(picture.no_film.begin(), picture.no_film.end(), i) == picture.no_film.end()) {
      add_square(picture.film_place(i), picture.film_px, 2);
    }
  }
  cv::Mat light(picture.height, picture.width, CV_32FC3);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      std::array<int, 4> counts{};
      for (int v = y * fine; v < (y + 1) * fine; ++v) {
        const std::uint8_t* row = layers.ptr<std::uint8_t>(v) + x * fine;
        for (int u = 0; u < fine; ++u) ++counts[row[u]];
      }
      for (int channel = 0; channel < 3; ++channel) {
        const double ink = picture.ink[channel];
        const double film = picture.film[channel];
        light.at<cv::Vec3f>(y, x)[channel] = static_cast<float>(
            (counts[0] + counts[1] * ink + counts[2] * film + counts[3] * ink * film) / (fine * fine));
      }
    }
  }
  if (picture.blur_px > 0.0) cv::GaussianBlur(light, light, {0, 0}, picture.blur_px);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const double u = (x + 0.5) / (0.5 * picture.width) - 1.0;
      const double v = (y + 0.5) / (0.5 * picture.height) - 1.0;
      const double lamp = 1.0 + picture.gradient.x() * u + picture.gradient.y() * v;
      for (int channel = 0; channel < 3; ++channel) {
        light.at<cv::Vec3f>(y, x)[channel] *= static_cast<float>(lamp * picture.white[channel]);
      }
    }
  }
  return light;
}

/// What an 8 bit camera makes of that light.
inline cv::Mat expose(const cv::Mat& light, double exposure = 1.0, double noise = 0.0, std::uint64_t seed = 1) {
  RandomStream random(seed, 0, Purpose::kTest);
  cv::Mat image(light.size(), CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        double value = exposure * light.at<cv::Vec3f>(y, x)[channel];
        if (noise > 0.0) value += noise * random.normal();
        image.at<cv::Vec3b>(y, x)[channel] = static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
      }
    }
  }
  return image;
}

inline cv::Mat paint_colour_markers(const ColourPicture& picture) {
  return expose(paint_colour_light(picture), 1.0, picture.noise, picture.seed);
}

/// The gel that a painted grid's markers sit on, 3 mm apart.
struct PaintedGel {
  double thickness_mm = 5.0;
  double viewing_distance_mm = 380.0;
};

/// Moves the markers by displacements (mm, gel frame: a press is -z): a pressed marker stretches by half the gel's
/// compression ([Lin2019, eq. 3], for a Poisson's ratio of 0.5), and is seen larger and farther from the picture's
/// middle as it is nearer (eq. 1).
inline void displace(ColourPicture& picture, const std::vector<Eigen::Vector3d>& displacements,
                     const PaintedGel& gel = {}) {
  const double px_per_mm = picture.spacing_px / 3.0;
  picture.shift_px.clear();
  picture.stretch.clear();
  for (std::size_t i = 0; i < picture.count(); ++i) {
    const Eigen::Vector3d& d = displacements[i];
    const double nearer = gel.viewing_distance_mm / (gel.viewing_distance_mm + d.z());
    const Eigen::Vector2d from_middle = picture.rest(i) - picture.middle_px;
    const Eigen::Vector2d moved = from_middle + picture.turn() * (px_per_mm * d.head<2>());
    picture.shift_px.push_back(nearer * moved - from_middle);
    picture.stretch.push_back(nearer * (1.0 - 0.5 * d.z() / gel.thickness_mm));
  }
}

/// A compact picture of small markers, as of a low-resolution camera: fast to paint.
inline ColourPicture small_colour_picture(double marker_px = 8.0) {
  ColourPicture picture;
  picture.columns = 6;
  picture.rows = 5;
  picture.marker_px = picture.film_px = marker_px;
  picture.spacing_px = 1.5 * marker_px;
  picture.width = static_cast<int>(std::lround(8.0 * picture.spacing_px));
  picture.height = static_cast<int>(std::lround(7.0 * picture.spacing_px));
  picture.middle_px = Eigen::Vector2d(0.5 * picture.width + 0.3, 0.5 * picture.height - 0.2);
  return picture;
}

}  // namespace touchstone::sensors::fixtures
