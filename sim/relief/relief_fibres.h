#pragma once

#include "core/random.h"
#include "sim/relief/relief_tile.h"

namespace touchstone::sim {

/// Loose round fibres that lie on a surface.
struct Fibres {
  double per_mm2 = 0.0;
  double length_mm = 1.0;      ///< mean; each is from half to one and a half of it
  double diameter_mm = 0.025;  ///< mean; each is from 0.7 to 1.3 of it
  double curl_per_mm = 1.0;    ///< standard deviation of the curvature along a fibre, 1/mm
  double alignment = 0.0;      ///< 0: all directions alike; towards 1: along y
};

/// Draws the fibres into a tile whose heights are those of the layer of fibres alone: a fibre's top is `level(k)` (mm,
/// k from 0 to 1 in the order of drawing) plus its round back; where fibres cross, the higher one shows.
void lay_fibres(ReliefTile& layer, const Fibres& fibres, const std::function<double(double)>& level,
                RandomStream& random);

/// Lays fibres on what is there: each raises the surface below it by its thickness.
void add_fuzz(ReliefTile& tile, const Fibres& fibres, RandomStream& random);

}  // namespace touchstone::sim
