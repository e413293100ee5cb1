#pragma once
// A true pinhole: light reaches a pixel through a round hole in a foil of some thickness, and nothing else.

#include <Eigen/Core>
#include <optional>

#include "core/transform.h"
#include "render/cameras/camera_ray.h"

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
};

/// Throws Error naming the first field that is out of range.
void check_camera(const PinholeCamera& camera);

/// The ray from the image point (`x`, `y`) in pixels through the place in the hole given by (`u`, `v`) in [0,1)^2. The
/// mean of `weight` over u, v is the exact solid-angle integral of cos over the part of the hole that the point sees
/// past both rims, so cos^4 fall-off and the foil's shadow come out of the geometry. nullopt where the foil hides all.
std::optional<CameraRay> pinhole_ray(const PinholeCamera& camera, double x, double y, double u, double v);

/// The unit vector of the camera frame along which an image point looks through the hole's centre.
Eigen::Vector3d view_direction(const PinholeCamera& camera, double x, double y);

/// The image point that looks along a vector of the camera frame; nullopt where it doesn't point forwards.
std::optional<Eigen::Vector2d> image_point(const PinholeCamera& camera, const Eigen::Vector3d& direction);

/// Where a point of the camera frame in front of the hole appears (pixels), seen through the hole's centre in air.
Eigen::Vector2d project(const PinholeCamera& camera, const Eigen::Vector3d& point_in_camera);

}  // namespace touchstone::render
