#pragma once
// The normal force of one press as a table over its depth, for what asks for it thousands of times: a collision's
// equation of motion, an actuator, a controller.

#include <vector>

#include "fem/contact/relaxation.h"
#include "sim/press/press_path.h"

namespace touchstone::sim {

/// Straight between its points; no force above the touch, at depth 0.
struct ForceLaw {
  std::vector<double> depth_mm;  ///< from 0, rising
  std::vector<double> force_N;   ///< beginning with 0
  // One standard error of the forces, of the mesh that they were computed on:
  double relative_error = 0.0;
  double least_error_N = 0.0;

  /// N, the larger of the two. @throws Error as force
  double error(double depth) const;

  /// N. @throws Error beyond the last depth, or for NaN
  double force(double depth) const;
  /// N/mm, of the piece that the depth is on (of the lower one at a point). @throws Error as force
  double stiffness(double depth) const;
  /// N mm, the work that takes it there. @throws Error as force
  double energy(double depth) const;
  /// mm. @throws Error for a force below zero or beyond the last, or if the forces don't rise
  double depth(double force) const;
};

/// The normal forces of a straight press whose points' shifts go down from the touch; points above it are left out.
/// @throws Error if there is no state below the touch, one moves sideways or goes up again, or an error isn't
/// finite or is negative
ForceLaw force_law(const PressPath& path, const PlayedPath& played, double relative_error, double least_error_N);

/// The force of a law along any history of depths on a gel that relaxes: the hereditary integral of the law's forces,
/// as in fem::FinitePress. So the gel comes back with the object, and never pulls: where the integral is below zero,
/// there is no force. Rate effects beyond the series, and the gel's own inertia, aren't in it.
class RelaxingForce {
 public:
  /// @throws Error for a series that isn't allowed. An empty one: the law itself
  RelaxingForce(ForceLaw law, fem::PronySeries series);

  /// N, after `seconds` in which the law's force went straight from that of the last depth (at first: 0) to that of
  /// this one. @throws Error as ForceLaw::force, and for a time that isn't finite or is negative; nothing is changed
  double step(double depth, double seconds);
  /// What step() would give, without going there.
  double after(double depth, double seconds) const;

  const ForceLaw& law() const { return law_; }

 private:
  ForceLaw law_;
  fem::PronySeries series_;
  fem::RelaxationHistory history_;
};

}  // namespace touchstone::sim
