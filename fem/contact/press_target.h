#pragma once
// What a press's target asks of its parts, in linear elasticity and at finite strain.

#include <Eigen/Core>
#include <vector>

#include "fem/contact/contact_gap.h"
#include "fem/contact/press.h"
#include "fem/contact/press_part.h"

namespace touchstone::fem {

/// @throws Error unless the target is finite, its rotation one, and its normal force and its time not negative
void check_target(const PressTarget& target);

/// The target as parts take it, its forced axes where the body is. What torque has turned the body by is kept along the
/// axes that are still led by torque: so much says `turn`.
PartTarget part_target(const PressTarget& target, const BodySnapshot& here, Eigen::Vector3d& turn);

/// N, along the surface.
double wanted_shear(const PartTarget& target);

/// @throws Error where a shear is wanted that the wanted normal force's friction can't hold, or, of a flat gel, a
/// torque that nothing within the body's reach can have
void refuse_what_slips(const PartTarget& target, const PressBody& body, bool flat);
/// Of a body that won't touch. @throws Error where a shear is wanted
void refuse_shear_of_nothing(const PartTarget& target);

/// A forced axis that nothing can push on stays where it is: without friction, along a flat surface.
void leave_free_axes(const ContactSurface& surface, double friction, PartTarget& target);

/// N mm, on the body about its own origin.
Eigen::Vector3d torque_on(const BodySnapshot& body);

/// The part's targets on a straight path from `start` to `to`, at its share `end`, for bodies that are at `from`, its
/// share `begin`: forces and torques go from those at the start, forced axes begin where the bodies are.
std::vector<PartTarget> targets_along(const std::vector<BodySnapshot>& start, const std::vector<PartTarget>& to,
                                      const std::vector<BodySnapshot>& from, double begin, double end);

/// The share of the straight path from `from`, where the body is clear, to `to`, where it overlaps, up to which it is
/// clear, by halving. `overlaps(pose)` says whether it does.
template <typename Overlaps>
double share_before_overlap(const RigidTransform& from, const RigidTransform& to, const Overlaps& overlaps) {
  double clear = 0.0;
  double overlapping = 1.0;
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (clear + overlapping);
    (overlaps(between(from, to, middle)) ? overlapping : clear) = middle;
  }
  return clear;
}

}  // namespace touchstone::fem
