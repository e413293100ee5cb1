#pragma once
// A sheet that scatters light to both sides: opal film, paper, cloth, a thin white membrane lit from behind.
//
//   scene.surfaces.push_back({sheet, DiffuseTransmitter{reflectance, transmittance}});
//
// Of the light that arrives on either side, `reflectance` leaves again on that side and `transmittance` on the other,
// both spread as by a matt surface (radiance the same in all directions); the rest is absorbed. The sheet has no
// thickness and stands in one medium: between two media put it a little to one side of their boundary. Lamps light it
// from both sides; nothing is seen straight through it, so it casts a shadow as any opaque thing does.

#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// Each from 0 to 1 in each band, their sum at most 1.
struct DiffuseTransmitter {
  Spectrum reflectance;
  Spectrum transmittance;
};

}  // namespace touchstone::render
