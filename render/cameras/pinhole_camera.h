#pragma once
// A true pinhole: light reaches a pixel through a round hole in a foil of some thickness, and nothing else.

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "core/transform.h"
#include "render/cameras/camera_ray.h"
#include "render/cameras/diffraction_spread.h"

namespace touchstone::render {

/// The hole is a straight cylinder through the foil: a ray must pass both rims. The camera frame's origin is the centre
/// of the hole, midway through the foil; +z looks at the scene, the sensor is the plane z = -distance_mm. The image is
/// turned upright, as read-out does: pixel coordinate (x, y) (core/transform.h) looks along
/// ((x - width/2) pitch, (y - height/2) pitch, distance).
struct PinholeCamera {
  int width = 640;
  int height = 480;
  double pixel_pitch_um = 3.45;
  double hole_diameter_um = 100.0;
  double foil_thickness_um = 50.0;
  double distance_mm = 2.0;  ///< from the hole's centre to the sensor
  RigidTransform gel_from_camera;
  /// In place of the hole's geometric disc; null: none. Rays are geometric all the same; sampled_ray.h and footprints
  /// have it.
  std::shared_ptr<const DiffractionSpread> diffraction;
};

/// Throws Error naming the first field that is out of range.
void check_camera(const PinholeCamera& camera);

/// The ray from the image point (`x`, `y`) in pixels through the place in the hole given by (`u`, `v`) in [0,1)^2. The
/// mean of `weight` over u, v is the exact solid-angle integral of cos over the part of the hole that the point sees
/// past both rims, so cos^4 fall-off and the foil's shadow come out of the geometry. nullopt where the foil hides all.
std::optional<CameraRay> pinhole_ray(const PinholeCamera& camera, double x, double y, double u, double v);

/// From the axis to an image point, mm on the sensor, along the picture's axes.
inline Eigen::Vector2d from_axis_mm(const PinholeCamera& camera, double x, double y) {
  return 1e-3 * camera.pixel_pitch_um * Eigen::Vector2d(x - 0.5 * camera.width, y - 0.5 * camera.height);
}
/// The inverse.
inline Eigen::Vector2d image_point_at(const PinholeCamera& camera, const Eigen::Vector2d& from_axis_mm) {
  return from_axis_mm / (1e-3 * camera.pixel_pitch_um) + 0.5 * Eigen::Vector2d(camera.width, camera.height);
}

/// The unit vector of the camera frame along which an image point looks through the hole's centre.
Eigen::Vector3d view_direction(const PinholeCamera& camera, double x, double y);

/// The image point that looks along a vector of the camera frame; nullopt where it doesn't point forwards.
std::optional<Eigen::Vector2d> image_point(const PinholeCamera& camera, const Eigen::Vector3d& direction);

/// Where a point of the camera frame in front of the hole appears (pixels), seen through the hole's centre in air.
Eigen::Vector2d project(const PinholeCamera& camera, const Eigen::Vector3d& point_in_camera);

}  // namespace touchstone::render
