#pragma once
// The bodies of visible lamps: flat one-sided discs and rectangles that rays can meet.
//
// A lamp that is visible can be found in two ways: by a connection from the place that it lights, and by a path that
// happens to run into it. Both are weighted with the balance heuristic [Veach1997, ch. 9], so that the sum counts the
// light once, whichever way does well: small lamps are found by connections, large ones that a glossy surface or a
// place close by sees also by paths. What only a path can find (after a mirroring at a flat face, or straight from the
// camera) it counts in full; what connections take in their own way (light through a Refractive surface, taken as flat,
// and from a rough boundary) is theirs alone.

#include <Eigen/Core>
#include <vector>

#include "render/sampling/warps.h"

namespace touchstone::render {

/// A disc (`radius` above 0) or rectangle about `centre`, square to `frame.z`.
struct LampBody {
  NormalFrame frame;
  Eigen::Vector3d centre;
  double radius = 0.0;
  double half_width = 0.0, half_height = 0.0;  ///< along frame.x and frame.y
  int lamp = 0;                                ///< its number in the scene
};

/// All visible lamps of a scene; they are few, so each ray tries all of them.
class LampBodies {
 public:
  bool empty() const { return bodies_.empty(); }
  void add(const LampBody& body) { bodies_.push_back(body); }

  /// The body that a ray meets.
  struct Hit {
    int lamp = -1;  ///< -1: nothing met
    double distance = 0.0;
  };
  /// The nearest body within `most` (mm, may be infinite) along a unit direction, from whichever side.
  Hit nearest(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double most) const;

  /// Is a body between the two points? One that an end point lies on isn't.
  bool stand_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

 private:
  std::vector<LampBody> bodies_;
};

}  // namespace touchstone::render
