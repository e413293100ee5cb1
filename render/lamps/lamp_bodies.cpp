#include "render/lamps/lamp_bodies.h"

#include <cmath>

namespace touchstone::render {
namespace {

/// @pre the point is in the body's plane
bool covers(const LampBody& body, const Eigen::Vector3d& point) {
  const Eigen::Vector3d off = point - body.centre;
  if (body.radius > 0.0) return off.squaredNorm() <= body.radius * body.radius;
  return std::abs(off.dot(body.frame.x)) <= body.half_width && std::abs(off.dot(body.frame.y)) <= body.half_height;
}

}  // namespace

LampBodies::Hit LampBodies::nearest(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    double most) const {
  Hit hit{-1, most};
  for (const LampBody& body : bodies_) {
    // Infinite or not a number for a ray in the body's plane: no hit.
    const double distance = (body.centre - origin).dot(body.frame.z) / direction.dot(body.frame.z);
    if (!(distance > 0.0 && distance < hit.distance) || !covers(body, origin + distance * direction)) continue;
    hit = {body.lamp, distance};
  }
  return hit;
}

bool LampBodies::stand_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  constexpr double kEnd = 1e-7;
  const Eigen::Vector3d offset = to - from;
  for (const LampBody& body : bodies_) {
    const double part = (body.centre - from).dot(body.frame.z) / offset.dot(body.frame.z);
    if (part > kEnd && part < 1.0 - kEnd && covers(body, from + part * offset)) return true;
  }
  return false;
}

}  // namespace touchstone::render
