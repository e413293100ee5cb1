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

/// What the sheet sends back with something of reflectance `behind` close behind it: light goes to and fro between the
/// two, which adds up to r + t^2 b / (1 - r b) in each band [Kubelka1948].
inline Spectrum reflectance_over(const DiffuseTransmitter& sheet, const Spectrum& behind) {
  const Spectrum through = sheet.transmittance * sheet.transmittance * behind;
  return sheet.reflectance + (through > 0.0).select(through / (1.0 - sheet.reflectance * behind), 0.0);
}

}  // namespace touchstone::render
