#pragma once

#include "render/scene/scene.h"

namespace touchstone::render {

/// The lamp's lobe: 1 within half_angle, a smooth step (3x^2 - 2x^3) down to 0 over soft_angle. `cosine` is that of
/// the angle from the lamp's direction.
double spot_profile(const SpotLamp& lamp, double cosine);

/// The solid angle that the lobe stands for, int profile d omega in sr: intensity on the axis = power / this.
double spot_solid_angle(const SpotLamp& lamp);

}  // namespace touchstone::render
