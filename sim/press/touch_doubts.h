#pragma once

#include <span>
#include <string>
#include <vector>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"
#include "sim/scene/device.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// What is to be doubted of a press for the surface that it leaves (fem/contact/surface_check.h): sentences without a
/// full stop, none if nothing is. `shapes`: of the objects in the press's order; null: an elastic one.
std::vector<std::string> touch_doubts(const GelSpec& material, const fem::Compliance& gel,
                                      std::span<const fem::ContactShape* const> shapes, const fem::PressState& state);
/// The same of a scene's objects.
std::vector<std::string> touch_doubts(const SceneSpec& scene, const fem::Compliance& gel, const fem::PressState& state);

}  // namespace touchstone::sim
