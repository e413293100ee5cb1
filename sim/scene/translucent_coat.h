#pragma once
// A coat of pigment in silicone that lets some light through: what touches it is seen, a little.
//
// Behind a free coat lies its own outer face to air, which sends most of the diffuse light back
// (diffuse_reflectance_within); what touches the coat wets it, and its own albedo takes the face's place. Either adds
// to what the coat sends back by itself (render::reflectance_over). Black bodies so look darker than the free coat, and
// white ones brighter.
//
// Not simulated: light from outside that comes in through the coat; light that spreads sideways in it, over about its
// thickness; an object's print; and a body that comes near without touching.

#include <vector>

#include "sim/files/colour.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Albedos that the coat has, seen from within.
struct TranslucentCoat {
  render::Spectrum free;                  ///< where air lies behind it
  std::vector<render::Spectrum> touched;  ///< where it lies on an object, by its number in moved_objects(); as free
                                          ///< where the scene switches the effect off
};

/// @pre the device has a matt coating
/// @throws Error that names the coating's place where albedo and transmittance are above 1 together, and the object's
/// where it is luminous
TranslucentCoat translucent_coat(const SceneSpec& scene, const SceneBands& bands);

/// By how much a coat's colour changes at most where something touches it, in parts of the free coat's.
double largest_change(const TranslucentCoat& coat);

}  // namespace touchstone::sim
