#include "render/direct/packet_horizons.h"

#include <algorithm>
#include <span>

#include "core/wide_clones.h"

namespace touchstone::render {
namespace {

/// One sector's beams, place by place, so that the places are what loops run over.
TS_WIDE_CLONES std::uint64_t pass_sector(const PacketHorizons& places, const BeamSector& sector, const float* lowest,
                                         const float* highest, const BesideBeam* beside, float* shares) {
  alignas(64) float horizon[2][kPacket], rise[2][kPacket];
  const BeamSector::Look* const looks[2] = {&sector.one, &sector.other};
  for (int side = 0; side < 2; ++side) {
    const BeamSector::Look& look = *looks[side];
    const SheetHorizons::Between between = SheetHorizons::between(look.azimuth);
    const float* const p0 = places.tangents[between.low];
    const float* const p1 = places.tangents[between.low + 1];
    const float* const p2 = places.tangents[between.low + 2];
    const float* const p3 = places.tangents[between.low + 3];
    for (int k = 0; k < kPacket; ++k) {
      horizon[side][k] = SheetHorizons::spline(p0[k], p1[k], p2[k], p3[k], between.share);
      rise[side][k] = places.rise_x[k] * look.x + places.rise_y[k] * look.y;
    }
  }
  float most = 0.0f;
  for (int k = 0; k < kPacket; ++k) most = std::max(most, std::max(horizon[0][k], horizon[1][k]));
  std::uint64_t touched = 0;
  for (int beam = sector.head; beam >= 0; beam = beside[beam].steeper) {
    const float low = lowest[beam];
    const float high = highest[beam];
    if (most <= low) break;  // steeper ones are free, too
    touched |= std::uint64_t{1} << beam;
    float* const share = shares + static_cast<std::size_t>(beam) * kPacket;
    alignas(64) float hidden[2][kPacket];
    for (int side = 0; side < 2; ++side) {
      for (int k = 0; k < kPacket; ++k) {
        const float from = std::max(low, rise[side][k]);
        const float part = std::min((horizon[side][k] - from) / (high - from), 1.0f);
        hidden[side][k] = (horizon[side][k] > from) & (high > from) ? part : 0.0f;
      }
    }
    for (int k = 0; k < kPacket; ++k) share[k] = 1.0f - 0.5f * (hidden[0][k] + hidden[1][k]);
  }
  return touched;
}

}  // namespace

std::uint64_t shares_over_horizons(const PacketHorizons& places, const BeamElevations& beams,
                                   const std::vector<BesideBeam>& beside, float* shares) {
  std::uint64_t touched = 0;
  for (const BeamSector& sector : beams.sectors) {
    touched |= pass_sector(places, sector, beams.lowest.data(), beams.highest.data(), beside.data(), shares);
  }
  return touched;
}

}  // namespace touchstone::render
