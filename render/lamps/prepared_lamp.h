#pragma once
// A lamp made ready for tracing: one struct for all kinds, so that the tracer's inner loop needs no visit.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "render/sampling/warps.h"
#include "render/scene/flat_faces.h"
#include "render/scene/lamp.h"
#include "render/scene/scene.h"
#include "render/scene/spot_light.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// How a lamp's light is spread over directions.
enum class LampKind { kSpot, kLobe, kProjector, kGuide };

/// The grey pattern of a projector, row by row from the top.
struct PreparedPattern {
  std::vector<float> values;
  int columns = 0, rows = 0;
  double half_width = 0.0, half_height = 0.0;  ///< on the plane at distance one

  /// The value in the direction whose tangents to the right and up are x and y; 0 beside the pattern.
  double at(double x, double y) const {
    const double column = std::floor((0.5 + 0.5 * x / half_width) * columns);
    const double row = std::floor((0.5 - 0.5 * y / half_height) * rows);
    if (!(column >= 0.0 && column < columns && row >= 0.0 && row < rows)) return 0.0;
    return double(values[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)]);
  }
};

/// A lamp of any kind, with N bands.
template <int N>
struct PreparedLamp {
  LampKind kind = LampKind::kSpot;
  Eigen::Vector3d position;    ///< its middle
  NormalFrame frame;           ///< z is the lobe's axis; x and y along the sides of a rectangle or pattern
  Bands<N> intensity_on_axis;  ///< W/sr
  double total_power;          ///< W, over the bands
  int layer;                   ///< number of faces below it
  double radius = 0.0;         ///< of a disc, or
  double half_width = 0.0, half_height = 0.0;  ///< of a rectangle; all 0 for a point
  double area = 0.0;                           ///< mm^2
  bool visible = false;

  SpotLamp spot;                                           ///< kSpot: its lobe
  double cos_full = 1.0;                                   ///< kSpot: within this cosine the lobe is at its top
  double exponent = 1.0;                                   ///< kLobe and kGuide
  std::shared_ptr<const PreparedPattern> pattern;          ///< kProjector
  Eigen::Vector3d exit_normal = Eigen::Vector3d::UnitX();  ///< kGuide: of its exit face

  explicit PreparedLamp(const Eigen::Vector3d& axis) : frame(axis) {}
};

/// @pre check_lamp holds
template <int N>
PreparedLamp<N> prepare_lamp(const Lamp& lamp, const std::vector<FlatFace>& faces) {
  const auto with_axis = [&](const Eigen::Vector3d& axis) {
    PreparedLamp<N> made(axis.normalized());
    made.position = lamp_position(lamp);
    made.intensity_on_axis = Bands<N>(lamp_power(lamp)) / emission_integral(lamp);
    made.total_power = lamp_power(lamp).sum();
    made.layer = layer_of_height(faces, made.position.z());
    made.visible = is_visible(lamp);
    return made;
  };
  if (const auto* spot = std::get_if<SpotLamp>(&lamp)) {
    PreparedLamp<N> made = with_axis(spot->direction);
    made.spot = *spot;
    made.cos_full = std::cos(spot->half_angle);
    made.radius = spot->lens_radius;
    made.area = kPi * made.radius * made.radius;
    return made;
  }
  if (const auto* led = std::get_if<LedLamp>(&lamp)) {
    PreparedLamp<N> made = with_axis(led->direction);
    made.kind = LampKind::kLobe;
    made.exponent = lobe_exponent(led->half_power_angle);
    made.radius = led->radius;
    made.area = kPi * made.radius * made.radius;
    return made;
  }
  if (const auto* area = std::get_if<AreaLamp>(&lamp)) {
    PreparedLamp<N> made = with_axis(area->direction);
    made.kind = LampKind::kLobe;
    made.exponent = lobe_exponent(area->half_power_angle);
    const RectangleSides sides = sides_of(*area);
    made.frame.x = sides.across;
    made.frame.y = sides.up;
    made.half_width = 0.5 * area->width;
    made.half_height = 0.5 * area->height;
    made.area = area->width * area->height;
    return made;
  }
  if (const auto* projector = std::get_if<ProjectedLamp>(&lamp)) {
    PreparedLamp<N> made = with_axis(projector->direction);
    made.kind = LampKind::kProjector;
    made.frame.x = made.frame.z.cross(projector->up).normalized();
    made.frame.y = made.frame.x.cross(made.frame.z);
    auto pattern = std::make_shared<PreparedPattern>();
    cv::Mat grey;
    projector->pattern.convertTo(grey, CV_32F);
    pattern->columns = grey.cols;
    pattern->rows = grey.rows;
    pattern->values.reserve(grey.total());
    for (int row = 0; row < grey.rows; ++row) {
      pattern->values.insert(pattern->values.end(), grey.ptr<float>(row), grey.ptr<float>(row) + grey.cols);
    }
    pattern->half_width = std::tan(projector->half_width_angle);
    pattern->half_height = pattern->half_width * grey.rows / grey.cols;
    made.pattern = std::move(pattern);
    return made;
  }
  const auto& guide = std::get<GuideLamp>(lamp);
  const Eigen::Vector3d level = Eigen::Vector3d(guide.direction.x(), guide.direction.y(), 0.0).normalized();
  PreparedLamp<N> made = with_axis(std::cos(guide.tilt) * level + std::sin(guide.tilt) * Eigen::Vector3d::UnitZ());
  made.kind = LampKind::kGuide;
  made.exponent = lobe_exponent(guide.half_power_angle);
  made.exit_normal = level;
  made.half_width = 0.5 * guide.width;
  made.half_height = 0.5 * (faces[made.layer].z - faces[made.layer - 1].z);
  made.area = 4.0 * made.half_width * made.half_height;
  return made;
}

/// Intensity that the lamp sends along a unit direction, as a share of that on its axis.
template <int N>
double emission_profile(const PreparedLamp<N>& lamp, const Eigen::Vector3d& from_lamp) {
  const double cosine = from_lamp.dot(lamp.frame.z);
  if (cosine <= 0.0) return 0.0;
  if (lamp.kind == LampKind::kSpot) return cosine >= lamp.cos_full ? 1.0 : spot_profile(lamp.spot, cosine);
  if (lamp.kind == LampKind::kLobe) return lamp.exponent == 1.0 ? cosine : std::pow(cosine, lamp.exponent);
  if (lamp.kind == LampKind::kGuide) {
    return from_lamp.dot(lamp.exit_normal) > 0.0 ? std::pow(cosine, lamp.exponent) : 0.0;
  }
  const double value = lamp.pattern->at(from_lamp.dot(lamp.frame.x) / cosine, from_lamp.dot(lamp.frame.y) / cosine);
  return value / (cosine * cosine * cosine);
}

/// A point of a flat lamp, uniform over its area for (u, v) uniform over the unit square.
template <int N>
Eigen::Vector3d point_on_lamp(const PreparedLamp<N>& lamp, const std::array<double, 2>& numbers) {
  Eigen::Vector3d source = lamp.position;
  const auto [u, v] = numbers;
  if (lamp.radius > 0.0) {
    const Eigen::Vector2d disc = lamp.radius * square_to_disc(u, v);
    source += disc.x() * lamp.frame.x + disc.y() * lamp.frame.y;
  } else if (lamp.half_width > 0.0) {
    source += (2.0 * u - 1.0) * lamp.half_width * lamp.frame.x + (2.0 * v - 1.0) * lamp.half_height * lamp.frame.y;
  }
  return source;
}

/// Radiance of a visible lamp along a unit direction before it, W/m^2/sr.
template <int N>
Bands<N> lamp_radiance(const PreparedLamp<N>& lamp, const Eigen::Vector3d& from_lamp) {
  constexpr double kSquareMillimetresPerSquareMetre = 1e6;
  const double cosine = from_lamp.dot(lamp.frame.z);
  if (!(cosine > 0.0)) return Bands<N>::Zero();
  return lamp.intensity_on_axis *
         (std::pow(cosine, lamp.exponent - 1.0) / lamp.area * kSquareMillimetresPerSquareMetre);
}

}  // namespace touchstone::render
