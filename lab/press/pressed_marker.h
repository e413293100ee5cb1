#pragma once
// How a square marker that is printed on a gel's outer surface looks when the gel is pressed: its outline goes with the
// material, and a pinhole camera sees it through the flat faces of gel and plate.

#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "fem/elements/compliance.h"
#include "fem/finite_strain/finite_gel.h"
#include "fem/shapes/contact_shape.h"
#include "render/cameras/camera.h"
#include "render/scene/scene.h"

namespace touchstone::lab {

/// Points of a flat gel's outer surface, each within a triangle of the mesh.
struct SurfacePoints {
  std::vector<Eigen::Vector2d> material_mm;
  std::vector<std::array<int, 3>> corners;     ///< vertices of the triangle
  std::vector<std::array<double, 3>> weights;  ///< of the corners, adding up to 1
};

/// Finds the points' triangles. @throws Error if a point isn't on the surface
SurfacePoints locate_points(std::span<const Eigen::Vector3d> vertices, std::span<const std::array<int, 3>> triangles,
                            std::vector<Eigen::Vector2d> points);

/// Where they are when the vertices are displaced (n x 3, mm).
std::vector<Eigen::Vector3d> displaced(const SurfacePoints& points, const Eigen::MatrixX3d& displacement);

/// A square about the origin: its outline, anticlockwise, and a grid of places evenly over its area.
struct MarkerPoints {
  SurfacePoints outline;
  SurfacePoints area;
};
/// On a surface of these vertices and triangles. @throws Error as locate_points
MarkerPoints square_marker(std::span<const Eigen::Vector3d> vertices, std::span<const std::array<int, 3>> triangles,
                           double side_mm);

/// A pressed marker.
struct PressedMarker {
  double force_N = 0.0;
  std::vector<Eigen::Vector3d> outline;  ///< mm, gel frame
  double displacement_mm = 0.0;          ///< mean over the marker, towards the plate
  double stretch = 1.0;                  ///< root of its area seen along the gel's normal over that at rest
  double largest_strain = 0.0;           ///< of the whole surface, see fem::PressState
};

/// A body pressed on the marker, straight down, to one force after the other.
struct MarkerPresses {
  std::vector<PressedMarker> presses;  ///< one a force, as far as they could be had
  std::string stopped;                 ///< why there are no more; empty if all could be had
};

/// By linear elasticity (fem/contact/press.h) or at finite strain (fem/finite_strain/finite_press.h, which takes at
/// most `most_factorisations` a step). The body's own origin is over the marker's middle.
/// @throws Error unless forces are above zero and rise, or for a shape or friction that isn't allowed
MarkerPresses press_marker(const fem::Compliance& gel, const MarkerPoints& marker, const fem::ContactShape& body,
                           double friction, std::span<const double> forces_N);
MarkerPresses press_marker(const fem::FiniteGel& gel, const MarkerPoints& marker, const fem::ContactShape& body,
                           double friction, std::span<const double> forces_N, int most_factorisations = 60);

/// Flat faces of plate and gel with nothing between: air, plate, gel. z = 0 is the gel's outer surface.
render::Scene bare_faces(double gel_mm, double gel_index, double plate_mm, double plate_index);

/// A pinhole of focal length `focal_length_mm` straight before the marker, `distance_mm` before the gel's outer surface
/// at rest. Its pixels are um, so that areas in px^2 are um^2 on the sensor.
render::ReadyCamera camera_before(double focal_length_mm, double distance_mm);

/// The area (mm^2 on the sensor) of an outline's picture, seen through the faces. @throws Error if the camera isn't in
/// front of the plate, or a point can't be seen
double pictured_area(const render::Scene& faces, const render::ReadyCamera& camera,
                     std::span<const Eigen::Vector3d> outline);

}  // namespace touchstone::lab
