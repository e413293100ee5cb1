#pragma once
// Single rays against surfaces and balls. Only this and packet_scene.h know Embree.
//
// Embree works in single precision; what it hits is found again here in double precision (on the triangle's plane, on
// the ball's exact sphere), and rays leave a surface from a point set off along its normal by leave_distance(), some
// tens of float steps: more than Embree's rounding, less than a tenth of a micrometre in a scene of a few cm.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "render/scene/scene.h"

namespace touchstone::render {

/// Where a ray met something. Normals are unit vectors and keep the surface's own sense (outward), whatever the side
/// that was hit.
struct RayHit {
  double distance = 0.0;
  Eigen::Vector3d position;
  Eigen::Vector3d normal;          ///< of the true geometry
  Eigen::Vector3d shading_normal;  ///< interpolated where the surface has normals or is Refractive, else `normal`
  Eigen::Vector3d lift;  ///< from `position` to where light leaves a surface with normals on the ray's side; else zero
  int object = -1;       ///< index of the surface, or surfaces.size() + index of the ball
  int triangle = -1;     ///< of the surface's mesh; -1 on a ball
  double weight_1 = 0.0, weight_2 = 0.0;  ///< barycentric weights of the triangle's second and third vertex
};

/// A ray as Embree gets it.
struct RecordedRay {
  float origin[3], direction[3], far;
  bool shadow;  ///< asked only whether anything opaque is in the way
};

/// The surfaces and balls of a scene, ready for rays; Embree's scene belongs to it, so it isn't copied or moved. Any
/// number of threads may ask it.
class RayScene {
 public:
  /// @pre check_scene(scene) holds.
  explicit RayScene(const Scene& scene);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// The nearest hit within `most` (mm, may be infinity) along a unit direction. A ray that isn't finite hits nothing.
  bool intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most, RayHit& hit) const;

  /// Does anything opaque (neither Refractive nor ThinFilm) stand between the two points?
  bool occluded(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  /// A box round all surfaces and balls; empty if there are none.
  const Eigen::AlignedBox3d& bounds() const;

  /// Are there ThinFilms?
  bool has_films() const;

  /// The nearest ThinFilm within `most` (mm, finite): only distance, normal and object of `hit` are set.
  bool intersect_film(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most, RayHit& hit) const;

  /// Distance to the nearest Refractive surface straight along +z (`up`) or -z within `most`; negative if there is
  /// none.
  double refractive_along_z(const Eigen::Vector3d& origin, bool up, double most) const;

  /// Are there Refractive surfaces, and does one cross the line between two points?
  bool has_refractive() const;
  /// Does a Refractive surface stand between the two points?
  bool meets_refractive(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
  /// How far the nearest surface or ball is from a point, if that is less than `most` (mm, finite); else `most`.
  double clearance(const Eigen::Vector3d& point, double most) const;

  /// Is all of the scene's geometry below (`up`) or above (not `up`) the height z?
  bool nothing_beyond(double z, bool up) const;

  /// From now on keeps a copy of each ray that intersect and occluded hand to Embree; nullptr ends it. For benches: one
  /// thread at a time.
  void record(std::vector<RecordedRay>* into) const;

  /// Only Embree's part of tracing these rays: how many met something.
  std::uint64_t trace_bare(std::span<const RecordedRay> rays) const;

  /// How far off a surface, along its normal, a ray must start not to meet it again (mm).
  static double leave_distance(const Eigen::Vector3d& position) {
    return 4e-6 * (1.0 + position.cwiseAbs().maxCoeff());
  }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace touchstone::render
