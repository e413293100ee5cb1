#pragma once
// Cases of `touchstone validate light` that ask where light goes: none is made, none is lost, and an imager's noise is
// that of the photons. Each returns the worst relative error of its parts.

#include <cstdint>

namespace touchstone::lab {

/// Bodies of rough glass, index 1.3 to 1.6 and alpha 0.05 to 0.6, in surroundings of one: seen from outside and within.
double rough_furnace(std::uint64_t seed, int effort);

/// A closed box of six unlike matt walls with a lamp and a ball of rough glass in it: power taken in over power sent
/// out.
double closed_box(std::uint64_t seed, int effort);

/// Light from a luminous disc on a coaxial one, against their form factor.
double coaxial_discs(std::uint64_t seed, int effort);

/// Each preset's variance against its mean, at a twentieth, a third and 0.8 of its full well.
double photon_transfer_of_presets(std::uint64_t seed, int effort);

}  // namespace touchstone::lab
