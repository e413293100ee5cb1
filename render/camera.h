#pragma once
// The cameras that the tracer takes.

#include <optional>
#include <variant>

#include "render/lens_camera.h"
#include "render/pinhole_camera.h"

namespace touchstone::render {

using Camera = std::variant<PinholeCamera, LensCamera>;

/// What the tracer samples: a camera that has been checked.
using ReadyCamera = std::variant<PinholeCamera, PreparedLens>;

/// @throws Error naming the first field that is out of range
inline ReadyCamera make_ready(const Camera& camera) {
  if (const auto* lens = std::get_if<LensCamera>(&camera)) return prepare(*lens);
  check_camera(std::get<PinholeCamera>(camera));
  return std::get<PinholeCamera>(camera);
}

/// Width and height in pixels.
inline Eigen::Vector2i size_of(const Camera& camera) {
  return std::visit([](const auto& one) { return Eigen::Vector2i(one.width, one.height); }, camera);
}

/// The ray of an image point and a place in the hole or on the lens; nullopt where no light passes.
inline std::optional<CameraRay> camera_ray(const PinholeCamera& camera, double x, double y, double u, double v) {
  return pinhole_ray(camera, x, y, u, v);
}
inline std::optional<CameraRay> camera_ray(const PreparedLens& camera, double x, double y, double u, double v) {
  return lens_ray(camera, x, y, u, v);
}

}  // namespace touchstone::render
