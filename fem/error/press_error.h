#pragma once

#include <Eigen/Core>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"

namespace touchstone::fem {

/// One standard error, from the mesh, of what a press says. Not in it: that linear elasticity leaves large strains out
/// (see PressState::largest_strain), and the contact solver's own residuals.
struct PressError {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, of each component of the force in the gel frame
  double displacement = 0.0;  ///< mm, of the surface within twice the contact's radius, root mean square; 0 where
                              ///< the press left the surface's displacement out
  double beads = 0.0;         ///< mm, of the bead that is furthest off
  double traction = 0.0;      ///< MPa, over the contact, root mean square
};

/// The errors of one press on `gel`, from its `mesh_error`. Each connected patch of contact is judged by itself: its
/// radius is twice the smaller standard deviation of its area (a disc's own radius), measured in its own edges; it's
/// taken for sharp as far as the pressure at its border is above that over the whole. The patches' forces' errors are
/// added up. All zero out of contact.
PressError estimate_error(const Compliance& gel, const PressState& state);

}  // namespace touchstone::fem
