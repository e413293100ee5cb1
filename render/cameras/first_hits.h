#pragma once
// What each pixel of a camera sees first: one ray a pixel, through its centre and that of hole or lens, distorted as
// the lens does and bent at the flat faces. And the inverse: where a point of the scene appears.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "render/cameras/camera.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// Where a pixel's ray ends, in the gel frame (mm).
struct FirstHit {
  int object = -1;          ///< index of the surface, or surfaces.size() + index of the ball; -1: it meets nothing
  int triangle = -1;        ///< of the surface; -1 on a ball
  double u = 0.0, v = 0.0;  ///< on a triangle a b c the position is (1 - u - v) a + u b + v c
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outward; the shading normal, see Surface
};

/// The first surface or ball of every pixel, row by row: Refractive ones count as what they are, a hit. A ray that is
/// totally reflected at a flat face meets nothing. Lamps and materials play no part. Pure: the same for any number of
/// threads. @throws Error as check_scene
std::vector<FirstHit> first_hits(const Scene& scene, const ReadyCamera& camera);

/// Where `point` (gel frame) appears in pixels, seen through the centre of hole or lens and the scene's flat faces,
/// whatever stands in between: p = n sin(angle) is the same in all layers (Snell), and the layers' distances across
/// must add up to the point's distance from the camera's plumb line. nullopt if it's behind the camera, or level with
/// it and not in its layer, or so far aside that no image point looks there (image_point).
/// @throws Error as check_faces: the faces' media must be in the scene
std::optional<Eigen::Vector2d> project_through_faces(const Scene& scene, const ReadyCamera& camera,
                                                     const Eigen::Vector3d& point);

}  // namespace touchstone::render
