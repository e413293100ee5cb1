#include "sim/press/state_between.h"

#include <Eigen/Geometry>

#include "core/error.h"

namespace touchstone::sim {
namespace {

RigidTransform pose_between(const RigidTransform& from, const RigidTransform& to, double part) {
  const Eigen::Quaterniond a(from.rotation);
  const Eigen::Quaterniond b(to.rotation);
  return {a.slerp(part, b).toRotationMatrix(), from.translation + part * (to.translation - from.translation)};
}

template <typename Matrix>
Matrix between(const Matrix& from, const Matrix& to, double part) {
  return from + part * (to - from);
}

}  // namespace

fem::PressState state_between(const fem::PressState& from, const fem::PressState& to, double part) {
  TS_ASSERT(part >= 0.0 && part <= 1.0 && from.bodies.size() == to.bodies.size());
  if (part == 0.0) return from;
  fem::PressState state = to;
  if (part == 1.0) return state;
  state.gel_from_object = pose_between(from.gel_from_object, to.gel_from_object, part);
  state.wrench = between(from.wrench, to.wrench, part);
  for (std::size_t k = 0; k < state.bodies.size(); ++k) {
    fem::BodyState& body = state.bodies[k];
    body.gel_from_object = pose_between(from.bodies[k].gel_from_object, to.bodies[k].gel_from_object, part);
    body.wrench = between(from.bodies[k].wrench, to.bodies[k].wrench, part);
  }
  state.traction = between(from.traction, to.traction, part);
  state.surface_displacement = between(from.surface_displacement, to.surface_displacement, part);
  state.bead_displacement = between(from.bead_displacement, to.bead_displacement, part);
  if (part < 0.5) {
    state.node_state = from.node_state;
    state.node_owner = from.node_owner;
  }
  return state;
}

}  // namespace touchstone::sim
