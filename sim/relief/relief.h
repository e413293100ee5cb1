#pragma once
// The fine relief that an object file may lay on its shape. See docs/file-formats.md.
//
// A kind of relief is a plain struct in a file of its own. It has `kType`, its name in files; `kSharp`: whether a pixel
// wider than half its finest detail misses it altogether (waves), and is refused, or sees it smoother (a picture);
// and three functions beside it: `fields`, `relief_map` and `finest_detail`. Here it is one line in ReliefKind.

#include <variant>

#include "core/yaml_reader.h"
#include "fem/shapes/relief_map.h"
#include "sim/relief/coin_relief.h"
#include "sim/relief/fabric_relief.h"
#include "sim/relief/fingerprint_relief.h"
#include "sim/relief/foam_relief.h"
#include "sim/relief/image_relief.h"
#include "sim/relief/leaf_relief.h"
#include "sim/relief/plastic_relief.h"
#include "sim/relief/plug_relief.h"
#include "sim/relief/print_relief.h"
#include "sim/relief/sandpaper_relief.h"
#include "sim/relief/tissue_relief.h"
#include "sim/relief/wave_reliefs.h"
#include "sim/relief/wood_relief.h"

namespace touchstone::sim {

/// Every kind of relief; which one is its `kType` in the file.
using ReliefKind = std::variant<WavesRelief, GridRelief, HairRelief, ImageRelief, PrintRelief, FingerprintRelief,
                                CoinRelief, PlugRelief, FabricRelief, FoamRelief, TissueRelief, SandpaperRelief,
                                PlasticRelief, WoodRelief, LeafRelief>;

/// Heights from 0 over the shape's lower side, mapped along the object's z axis; the plain shape is the floor. Only the
/// fields that belong to `type` may stand in the file.
struct ReliefSpec {
  ReliefKind kind;
};

void fields(YamlReader& in, ReliefSpec& relief);

/// The finest detail, mm. May read files. @throws Error for one that can't be read
double finest_detail(const ReliefSpec& relief);

/// @throws Error for a file that can't be read
fem::ReliefMap relief_map(const ReliefSpec& relief);

/// kSharp of its kind.
bool is_sharp(const ReliefSpec& relief);

}  // namespace touchstone::sim
