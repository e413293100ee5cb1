#pragma once
// The cameras that the tracer takes.

#include <optional>
#include <variant>

#include "render/cameras/lens_camera.h"
#include "render/cameras/pinhole_camera.h"

namespace touchstone::render {

/// A camera as a scene's user gives it; Tracer and DirectRenderer make it ready.
using Camera = std::variant<PinholeCamera, LensCamera>;

/// What the tracer samples: a camera that has been checked.
using ReadyCamera = std::variant<PinholeCamera, PreparedLens>;

/// @throws Error naming the first field that is out of range
inline ReadyCamera make_ready(const Camera& camera) {
  if (const auto* lens = std::get_if<LensCamera>(&camera)) return prepare(*lens);
  check_camera(std::get<PinholeCamera>(camera));
  return std::get<PinholeCamera>(camera);
}

/// Image points (left + spacing i, top + spacing j), 0 <= i < columns, 0 <= j < rows, in pixels.
struct ImageGrid {
  double left = 0.5, top = 0.5, spacing = 1.0;
  int columns = 0, rows = 0;
};

/// Width and height in pixels.
inline Eigen::Vector2i size_of(const Camera& camera) {
  return std::visit([](const auto& one) { return Eigen::Vector2i(one.width, one.height); }, camera);
}
inline Eigen::Vector2i size_of(const ReadyCamera& camera) {
  return std::visit([](const auto& one) { return Eigen::Vector2i(one.width, one.height); }, camera);
}

/// Where it is: the centre of hole or lens is the origin of the camera frame.
inline const RigidTransform& pose_of(const ReadyCamera& camera) {
  return std::visit([](const auto& one) -> const RigidTransform& { return one.gel_from_camera; }, camera);
}

/// The unit vector of the camera frame along which an image point looks through the centre of hole or lens; nullopt
/// where a lens's distortion has no inverse.
inline std::optional<Eigen::Vector3d> view_direction(const ReadyCamera& camera, double x, double y) {
  return std::visit([&](const auto& one) -> std::optional<Eigen::Vector3d> { return view_direction(one, x, y); },
                    camera);
}

/// The inverse: the image point, in the picture or beside it, that looks along a vector of the camera frame of any
/// length; nullopt where none does.
inline std::optional<Eigen::Vector2d> image_point(const ReadyCamera& camera, const Eigen::Vector3d& direction) {
  return std::visit([&](const auto& one) { return image_point(one, direction); }, camera);
}

/// The ray of an image point and a place in the hole or on the lens; nullopt where no light passes.
inline std::optional<CameraRay> camera_ray(const PinholeCamera& camera, double x, double y, double u, double v) {
  return pinhole_ray(camera, x, y, u, v);
}
inline std::optional<CameraRay> camera_ray(const PreparedLens& camera, double x, double y, double u, double v) {
  return lens_ray(camera, x, y, u, v);
}

}  // namespace touchstone::render
