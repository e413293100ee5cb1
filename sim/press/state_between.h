#pragma once

#include "fem/contact/press.h"

namespace touchstone::sim {

/// What a press is like between two states, `part` (0 to 1) of the path: positions, displacements, tractions and forces
/// run straight, rotations at a constant rate. Which vertices touch is taken from the nearer state; what tells of the
/// solver is the later state's.
fem::PressState state_between(const fem::PressState& from, const fem::PressState& to, double part);

}  // namespace touchstone::sim
