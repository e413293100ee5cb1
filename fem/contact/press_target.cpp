#include "fem/contact/press_target.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

using Kind = AxisControl::Kind;

void check_target(const PressTarget& target) {
  if (!std::isfinite(target.seconds) || target.seconds < 0.0) {
    fail("a step takes {} s; it must be finite and at least 0", target.seconds);
  }
  const char* const names[] = {"x", "y", "z"};
  for (int a = 0; a < 3; ++a) {
    if (!std::isfinite(target.axis[a].value)) {
      fail("the {} {} of the press is {}, it must be finite", names[a],
           target.axis[a].kind == Kind::force ? "force" : "position", target.axis[a].value);
    }
  }
  if (!target.rotation.allFinite()) fail("the object's rotation holds NaN or infinity");
  const double error = (target.rotation.transpose() * target.rotation - Eigen::Matrix3d::Identity()).norm();
  if (error > 1e-6 || target.rotation.determinant() < 0.0) {
    fail("the object's rotation isn't one: R^T R differs from 1 by {:.3g}, det R = {:.3g}", error,
         target.rotation.determinant());
  }
  for (int a = 0; a < 3; ++a) {
    if (target.torque[a] && !std::isfinite(*target.torque[a])) {
      fail("the torque about {} of the press is {}, it must be finite", names[a], *target.torque[a]);
    }
  }
  if (target.axis[2].kind == Kind::force && target.axis[2].value < 0.0) {
    fail("a normal force of {} N is wanted: contact can't pull, it must be at least 0", target.axis[2].value);
  }
}

PartTarget part_target(const PressTarget& target, const BodySnapshot& here, Eigen::Vector3d& turn) {
  PartTarget to;
  to.pose = {target.rotation, here.pose.translation};
  turn = here.turn;
  for (int a = 0; a < 3; ++a) {
    to.forced[a] = target.axis[a].kind == Kind::force;
    (to.forced[a] ? to.force[a] : to.pose.translation[a]) = target.axis[a].value;
    to.turned[a] = target.torque[a].has_value();
    to.torque[a] = target.torque[a].value_or(0.0);
    if (!to.turned[a]) turn[a] = 0.0;
  }
  if (turn.norm() > 0.0) to.pose.rotation = turned_by(turn) * to.pose.rotation;
  return to;
}

double wanted_shear(const PartTarget& target) {
  return std::hypot(target.forced[0] ? target.force[0] : 0.0, target.forced[1] ? target.force[1] : 0.0);
}

void refuse_what_slips(const PartTarget& target, const PressBody& body, bool flat) {
  const double mu = body.friction;
  const double shear = wanted_shear(target);
  if (shear > 0.0 && mu == 0.0) fail("gross slip: a shear force of {:.6g} N is wanted without friction", shear);
  if (!target.forced[2]) return;
  const double normal = target.force[2];
  const double held = normal > 0.0 && mu > 0.0 ? mu * normal : 0.0;
  if (shear > 0.0 && shear >= held * (1.0 - 1e-9)) {
    fail(
        "gross slip: a shear force of {:.6g} N is wanted, but a normal force of {:.6g} N with a friction of {:.4g} "
        "holds less than {:.6g} N",
        shear, normal, mu, held);
  }
  // No contact is farther from the body's origin than the body reaches, and none gives more than the normal force and
  // the friction by it.
  const BoundingBall ball = bounding_ball(body.shape);
  const double arm = ball.centre.norm() + ball.radius;
  const double most = arm * normal * std::hypot(1.0, mu);
  if (flat && normal > 0.0 && target.torque.norm() > most) {
    fail(
        "the object turns over: a torque of {:.6g} N mm is wanted, but a normal force of {:.6g} N with a friction of "
        "{:.4g} within {:.4g} mm of its origin holds at most {:.6g} N mm",
        target.torque.norm(), normal, mu, arm, most);
  }
}

void refuse_shear_of_nothing(const PartTarget& target) {
  const double shear = wanted_shear(target);
  if (shear > 0.0) fail("gross slip: a shear force of {:.6g} N is wanted, but the object doesn't touch the gel", shear);
}

void leave_free_axes(const ContactSurface& surface, double friction, PartTarget& target) {
  if (friction > 0.0) return;
  const auto& normals = surface.normals;
  for (int a = 0; a < 3; ++a) {
    const bool pushed = std::any_of(normals.begin(), normals.end(),
                                    [&](const Eigen::Vector3d& normal) { return std::abs(normal[a]) > 1e-12; });
    if (!pushed) target.forced[a] = false;
    if (surface.flat && std::abs(normals.front()[a]) > 1.0 - 1e-12) target.turned[a] = false;
  }
}

Eigen::Vector3d torque_on(const BodySnapshot& body) {
  return body.moment - body.pose.translation.cross(body.force);
}

std::vector<PartTarget> targets_along(const std::vector<BodySnapshot>& start, const std::vector<PartTarget>& to,
                                      const std::vector<BodySnapshot>& from, double begin, double end) {
  std::vector<PartTarget> targets(to);
  for (std::size_t b = 0; b < targets.size(); ++b) {
    PartTarget& target = targets[b];
    target.pose = between(start[b].pose, to[b].pose, end);
    for (int a = 0; a < 3; ++a) {
      if (target.forced[a]) target.pose.translation[a] = from[b].pose.translation[a];
    }
    if (target.turned[0] || target.turned[1] || target.turned[2]) {
      // What torque has turned the body by since the path's start comes on top of the path.
      const Eigen::Matrix3d so_far = between(start[b].pose, to[b].pose, begin).rotation;
      target.pose.rotation = from[b].pose.rotation * so_far.transpose() * target.pose.rotation;
    }
    if (end < 1.0) {
      target.force = start[b].force + end * (target.force - start[b].force);
      target.torque = torque_on(start[b]) + end * (target.torque - torque_on(start[b]));
    }
  }
  return targets;
}

}  // namespace touchstone::fem
