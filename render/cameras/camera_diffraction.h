#pragma once
// Diffraction and places on the sensor, of either kind of camera.

#include <variant>

#include "render/cameras/camera.h"

namespace touchstone::render {

/// Of a Camera or a ReadyCamera; null: none.
template <typename AnyCamera>
const DiffractionSpread* diffraction_of(const AnyCamera& camera) {
  return std::visit([](const auto& one) { return one.diffraction.get(); }, camera);
}

/// See those of the two kinds.
inline Eigen::Vector2d from_axis_mm(const ReadyCamera& camera, const Eigen::Vector2d& image_point) {
  return std::visit([&](const auto& one) { return from_axis_mm(one, image_point.x(), image_point.y()); }, camera);
}
/// The inverse.
inline Eigen::Vector2d image_point_at(const ReadyCamera& camera, const Eigen::Vector2d& from_axis_mm) {
  return std::visit([&](const auto& one) { return image_point_at(one, from_axis_mm); }, camera);
}

}  // namespace touchstone::render
