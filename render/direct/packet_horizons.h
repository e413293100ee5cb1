#pragma once
// How much of a guide's beams gets over the horizons round sixteen places beside each other.

#include <cstdint>
#include <vector>

#include "render/direct/light_field.h"
#include "render/direct/sheet_horizons.h"
#include "render/scene/packet_scene.h"

namespace touchstone::render {

/// What sixteen places have round them. Zeros stand for a place that no horizon shades.
struct PacketHorizons {
  alignas(64) float tangents[SheetHorizons::kAround][kPacket];  ///< as SheetHorizons::at gives a place's
  alignas(64) float rise_x[kPacket], rise_y[kPacket];           ///< how steeply the place itself rises along x and y
};

/// Beams of one azimuth, from the flattest on, and from where horizons are held against them: two azimuths, half way to
/// where the sector ends.
struct BeamSector {
  /// Where horizons are looked up.
  struct Look {
    float azimuth;
    float x, y;  ///< its unit vector
  };
  int head;  ///< the flattest beam
  Look one, other;
};

/// Beams before horizons: the same for all places of a packet.
struct BeamElevations {
  std::vector<BeamSector> sectors;
  std::vector<float> lowest, highest;  ///< by beam: the tangents of elevation between which it goes down
};

/// Of each beam the part that is steeper than the horizon gets through, of what is above the place's own plane: what is
/// below is taken off elsewhere. `shares` is [beam][place] and filled for the beams whose bit is returned; all others
/// get through whole.
std::uint64_t shares_over_horizons(const PacketHorizons& places, const BeamElevations& beams,
                                   const std::vector<BesideBeam>& beside, float* shares);

}  // namespace touchstone::render
