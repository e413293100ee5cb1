#pragma once
// The least error that any unbiased estimate of a force can have which is made from where the beads are seen: the
// Cramer-Rao bound. It depends on the gel and the camera, not on the estimator, so it shows a designer which of them to
// change.
//
// With y the beads' pixels, f the force, S = dy/df and y normal about its mean with the covariance C = diag(sigma^2),
// Fisher's information is S^T C^-1 S, and no unbiased estimate of f has a covariance below its inverse [Kay1993, eq.
// 3.31]. Who doesn't know where the object is has more to estimate from the same pixels: the information on force and
// place together, inverted, has the larger bound.

#include <Eigen/Core>

#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"
#include "lab/vhs/bead_view.h"
#include "sensors/tractions/marker_compliance.h"

namespace touchstone::lab {

/// A load at which sensitivities are asked for: pressed to the normal force first, then sheared.
struct BoundLoad {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of the object's origin before it's pressed
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();   ///< on the object; z above 0
};

/// How pixels go with force and place. Rows are x and y of each bead, bead by bead (2 m).
struct ForceSensitivity {
  Eigen::VectorXd pixels;       ///< at the load, px
  Eigen::MatrixX3d force;       ///< px/N
  Eigen::MatrixX2d place;       ///< px/mm
  double depth_mm = 0.0;        ///< how far the object has gone down from where it began
  double largest_strain = 0.0;  ///< at the load, see fem::PressState
};

/// By central differences of presses with friction from the first touch on, the object free to go along the gel where
/// no shear is asked for. @param start_z_mm where the object's origin is before the press, clear of the gel
/// @throws Error as fem::Press::step, or if a bead can't be seen
ForceSensitivity force_sensitivity(const fem::Compliance& gel, const BeadView& view, const fem::ContactShape& object,
                                   double friction, double start_z_mm, const BoundLoad& load);

/// One standard deviation, N, of x, y, z; infinite where the beads don't identify it.
struct ForceBound {
  Eigen::Vector3d place_known;
  Eigen::Vector3d place_unknown;
};

/// @param deviation_px of each pixel coordinate (2 m), above 0; infinity: that one isn't seen
ForceBound force_bound(const ForceSensitivity& sensitivity, const Eigen::VectorXd& deviation_px);

/// The bound on the forces of a grid of patches, each of uniform traction, that act at once: 3 x patches, N, one
/// standard deviation of x, y, z of each. `compliance` is that of the beads (bead_compliance), without load. Infinite
/// where there are more unknowns than the beads can identify.
Eigen::Matrix3Xd distribution_bound(const sensors::MarkerCompliance& compliance, const BeadView& view,
                                    const Eigen::VectorXd& deviation_px);

/// Standard deviations (infinite where undetermined) of the unknowns that `sensitivity`'s columns stand for.
Eigen::VectorXd least_deviations(const Eigen::MatrixXd& sensitivity, const Eigen::VectorXd& deviation);

}  // namespace touchstone::lab
