#pragma once
// Rays against surfaces and balls. The only part that knows Embree.
//
// Embree works in single precision; what it hits is found again here in double precision (on the triangle's plane, on
// the ball's exact sphere), and rays leave a surface from a point set off along its normal by leave_distance(), some
// tens of float steps: more than Embree's rounding, less than a tenth of a micrometre in a scene of a few cm.

#include <Eigen/Core>
#include <memory>

#include "render/scene.h"

namespace touchstone::render {

/// Where a ray met something. Normals are unit vectors and keep the surface's own sense (outward), whatever the side
/// that was hit.
struct RayHit {
  double distance = 0.0;
  Eigen::Vector3d position;
  Eigen::Vector3d normal;          ///< of the true geometry
  Eigen::Vector3d shading_normal;  ///< interpolated from the vertices on Refractive surfaces, else `normal`
  int object = -1;                 ///< index of the surface, or surfaces.size() + index of the ball
  int triangle = -1;               ///< of the surface; -1 on a ball
  double u = 0.0, v = 0.0;         ///< on a triangle: position = (1 - u - v) a + u b + v c
};

class RayScene {
 public:
  /// @pre check_scene(scene) holds.
  explicit RayScene(const Scene& scene);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// The nearest hit within `most` (mm, may be infinity) along a unit direction. A ray that isn't finite hits nothing.
  bool intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most, RayHit& hit) const;

  /// Does anything opaque (not Refractive) stand between the two points?
  bool occluded(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  /// Distance to the nearest Refractive surface straight along +z (`up`) or -z within `most`; negative if there is
  /// none.
  double refractive_along_z(const Eigen::Vector3d& origin, bool up, double most) const;

  /// Is all of the scene's geometry below (`up`) or above (not `up`) the height z?
  bool nothing_beyond(double z, bool up) const;

  /// How far off a surface, along its normal, a ray must start not to meet it again (mm).
  static double leave_distance(const Eigen::Vector3d& position) {
    return 4e-6 * (1.0 + position.cwiseAbs().maxCoeff());
  }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace touchstone::render
