#pragma once
// Which lamps can be hidden from a place of the membrane at all.

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <vector>

#include "render/direct/light_field.h"
#include "render/scene/scene.h"

namespace touchstone::render {

inline constexpr int kMostDirectLamps = 64;  ///< lamps and beams of guides: each is a bit of ShadowReach's masks

/// Where the lamps stand as seen from the cells of a coarse map over a light field's box: made once a fixture.
struct LampBearings {
  /// Directions towards a lamp are written as mm across a mm of height.
  struct Bearing {
    float x = 0.0f, y = 0.0f;
    float length = 0.0f;                                    ///< of (x, y)
    float spread = std::numeric_limits<float>::infinity();  ///< no direction from the cell differs by more
    float swing = std::numeric_limits<float>::infinity();   ///< nor its unit vector across by more
    float side = 0.0f;                                      ///< 1: the lamp is above, -1: below
  };

  float left = 0.0f, bottom = 0.0f, cell = 1.0f;  ///< mm
  int columns = 0, rows = 0, lamps = 0;
  float floor = 0.0f, slab = 1.0f;  ///< mm: the box's height is cut into slabs
  int slabs = 1;
  std::vector<Bearing> bearings;  ///< [slab][row][column][lamp]
  std::vector<float> longest;     ///< by lamp: the most of length + spread, infinite if that isn't known everywhere
  /// Round all lamps' luminous faces, seen along z. Layers have level faces, so light that passes them keeps its
  /// azimuth: from lamp to place it runs straight in the level plane.
  Eigen::AlignedBox2d shining;
  UprightWalls walls;  ///< whose shadows the field has

  /// `soft`: shadow rays will go to all points of each lens, not to its middle only.
  LampBearings(const LightField& field, bool soft);

  /// Index of the cell that holds a place, -1 beside the map.
  int cell_at(float x, float y) const;
  /// Number of the slab that holds a height, the nearest one for heights beside them.
  int slab_at(float z) const;
  /// That of a lamp, by slab and cell of the map.
  const Bearing& bearing(int at_slab, int row, int column, int lamp) const {
    return bearings[((static_cast<std::size_t>(at_slab) * rows + row) * columns + column) * lamps + lamp];
  }
};

/// Where the first surface is a connected sheet whose triangles all face the same side along z (a height field), a ray
/// that leaves it and climbs faster than the sheet does anywhere under its path can't meet it, and a ball hides a lamp
/// only from the places that lie in its shadow. Other surfaces are taken for columns along z over the cells they
/// cover, but for walls round a sheet and lamps that stand within them: what runs straight from lamp to sheet doesn't
/// meet those. All answers are safe: a lamp that something hides is never left out.
class ShadowReach {
 public:
  /// `connected`: what is_connected says of the first surface, kept by those who draw the same triangles again.
  /// `bearings` must outlive this.
  ShadowReach(const LampBearings& bearings, const Scene& scene, bool connected);

  /// Bit k is set where lamp k may be hidden from this place on object `from` (the number of a PacketHits::object).
  std::uint64_t doubtful(float x, float y, int from) const;

  /// Is the sheet alone in what can hide a lamp? Then where a ray from it doesn't meet it no steeper ray of the same
  /// azimuth does.
  bool only_sheet() const { return only_sheet_; }

  /// The height that a ray has to reach to be clear of everything.
  float low() const { return low_; }
  float high() const { return high_; }

 private:
  const LampBearings& bearings_;
  bool sheet_ = false, only_sheet_ = false;
  float low_ = 0.0f, high_ = 0.0f;  // of everything, padded
  std::uint64_t all_ = 0;
  std::vector<std::uint64_t> doubt_;  // by cell
};

/// Is the first surface alone in what can hide a lamp from it? So it is without balls, where other surfaces are films,
/// or walls round it with light guides for lamps that stand within them.
bool is_sheet_alone(const LampBearings& bearings, const Scene& scene);

/// Are the triangles connected by common vertices? True without any.
bool is_connected(const TriangleMesh& mesh);

}  // namespace touchstone::render
