#pragma once
// The ways that light takes through a milky slab under a dark coat, from lamps behind the slab to a camera there.
//
// They are followed from the camera: a walk enters at the slab's back, is scattered some times and goes out straight
// along the direction from which a lamp shines. A coat ends what reaches it. So of a slab whose coat is pressed in
// those walks are left that stay below the coat wherever they go: one set of walks serves any shape of the coat. What a
// walk needs to be known of is how high it comes over each small square of the back.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "render/scene/scene.h"

namespace touchstone::render {

/// A slab for one band of light, between the faces z = -thickness and z = 0.
struct CoatedSlab {
  double thickness_mm = 0.0;
  double absorption_per_mm = 0.0;  ///< natural logarithm
  double scattering_per_mm = 0.0;
  double anisotropy = 0.0;
  double index = 1.41;
  double index_below = 1.0;  ///< of what lies at its back
};

/// Light that a lamp sends to a place of the slab's back, as if the slab were clear.
struct LampArrival {
  Eigen::Vector2d place;      ///< mm
  Eigen::Vector3d direction;  ///< unit, in the slab, towards where it comes from: z < 0
  double irradiance = 0.0;    ///< on an area square to it, summed over the bands
};

/// What the lamps of a scene send to `columns` x `rows` places over a back of size_x by size_y mm at the height z, row
/// by row; a lamp with an area is a point, without what it lights being hidden by anything.
/// @throws Error as PreparedScene, or if there's no light at all
std::vector<LampArrival> arrivals_at_back(const Scene& fixture, double z, const Eigen::Vector2d& size_mm, int columns,
                                          int rows);

/// The quarter, in azimuth, that light comes from: 0 +x, 1 +y, 2 -x, 3 -y.
inline constexpr int kLightSides = 4;
int side_of(const Eigen::Vector3d& direction);  ///< as above
/// How many walks are made, and of which stream.
struct CoatWalkSettings {
  std::uint64_t seed = 1;
  int drawn = 1 << 18;    ///< camera walks for each side of light; of all their ways to lamps
  int kept = 512;         ///< are left for each side, each of the same weight
  double cell_mm = 0.2;   ///< squares
  double reach_mm = 8.0;  ///< ways that go farther aside are left out
  double thickest = 1.3;  ///< in thicknesses: how far the coat may bulge
  int depths = 8;         ///< classes of the height at which a walk is scattered first
};

/// A square beside the one that a walk starts in, and how high over the back the walk comes there.
struct CoatCell {
  std::int16_t dx = 0, dy = 0;
  float height_mm = 0.0F;
};

/// One way; its cells go from the highest to the lowest.
struct CoatWalk {
  std::uint32_t first = 0, count = 0;  ///< of CoatWalks::cells
  std::uint8_t side = 0, depth = 0;
};

/// Ways of a slab. Walks begin straight up; those of a camera that looks aslant differ by where they are scattered
/// first (coat_light.h). Within a side all have the same weight.
struct CoatWalks {
  CoatedSlab slab;
  double cell_mm = 0.0;
  int reach = 0;                                ///< cells
  std::vector<double> depth_mm;                 ///< mean height of a class's first scatterings
  std::array<double, kLightSides> weight = {};  ///< of a walk: what it brings, in parts of what falls onto the back
  std::vector<CoatWalk> walks;
  std::vector<CoatCell> cells;
};

/// Draws and keeps them: systematic resampling by weight. The same for any number of threads.
/// @throws Error for a slab that doesn't scatter, settings out of range, or no light
CoatWalks walk_under_coat(const CoatedSlab& slab, const std::vector<LampArrival>& arrivals,
                          const CoatWalkSettings& settings = {});

}  // namespace touchstone::render
