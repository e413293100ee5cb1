#pragma once
// What the lamps of a static fixture send to each place that a membrane may reach, ahead of time.
//
// The vector irradiance F of a lamp [Gershun1939] is the integral of radiance times direction: a matt surface of normal
// n that sees all of the lamp gets the irradiance max(0, -n.F). It is smooth in space, so a coarse grid holds it.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "render/lamps/guide_beams.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// How fine the grid is made, and how lamps are cut into beams.
struct LightFieldSettings {
  double accuracy = 2e-3;     ///< relative RMS error of interpolation to reach, see LightField::error
  int lens_points = 4;        ///< a lamp's lens is averaged over lens_points^2 places; a point lamp takes one
  GuideCut guides;            ///< into what beams light guides are cut
  int guide_points = 3;       ///< guide_beam_flows, 1 to 16
  int most_beams = 64;        ///< of all lamps together, see LightField; a direct renderer takes no more
  int most_flows = 64000000;  ///< nodes times beams, of 16 bytes each
  /// Round what is lit, on the face of its layer that light guides are beyond: their light has their shadows.
  UprightWalls walls;
  /// What is lit stays so near to the z axis, mm: only there the grid has to be accurate. 0: in all of the box.
  double lit_radius = 0.0;
};

/// Which beams of the same guide lie beside a beam; -1 where there is none.
struct BesideBeam {
  int flatter = -1, steeper = -1, left = -1, right = -1;
};

/// A regular grid over a box. Between nodes F is interpolated linearly along each axis.
///
/// What the grid holds are beams: a lamp is one, a light guide several (guide_beams.h); those of them that bring
/// little are put together. F is kept as that of unit intensity without absorption, (W/m^2)/(W/sr) in the direction
/// that light flows; a band's is intensity[beam][band] times `pass` times that. With absorbing media `pass` is the
/// share of each band that arrives, taken along F's own direction: exact for a point lamp, off to second order in the
/// angle that a lens fills.
struct LightField {
  Scene fixture;  ///< media, faces, lamps, environment; no surfaces and no balls
  Eigen::AlignedBox3d reach;
  int layer = 0;  ///< the box lies in it: number of faces below
  double index = 1.0;
  UprightWalls walls;  ///< LightFieldSettings::walls
  Eigen::Array3i nodes = Eigen::Array3i::Zero();
  Eigen::Array3d step = Eigen::Array3d::Zero();  ///< mm
  std::vector<int> lamp_of;                      ///< index into fixture.lamps, by beam; beams of a lamp in a row
  std::vector<Spectrum> intensity;               ///< W/sr on the lamp's axis, by beam
  std::vector<BesideBeam> beside;                ///< by beam
  std::vector<float> flow;  ///< [node][beam][4]: F and its length; node = x + nodes.x (y + nodes.y z)
  std::vector<float> pass;  ///< [node][beam][band], empty where nothing absorbs
  /// Estimate: root mean square over the middles of cells (that reach into `lit_radius`), where linear interpolation is
  /// worst, of |F - exact| summed over the lamps by power, over the same of |exact|.
  double error = 0.0;

  int beam_count() const { return static_cast<int>(intensity.size()); }
  const Lamp& lamp(int beam) const { return fixture.lamps[lamp_of[beam]]; }
};

/// The frame of a sheet as walls, for a field over `reach`: where it is the only other thing of `rest`, stands upright
/// on the face that the lamps are beyond, and hides light guides that stand outside of it. Else none: then nothing is
/// hidden, or rays have to say what.
UprightWalls walls_round_sheet(const Scene& rest, const Eigen::AlignedBox3d& reach);

/// Computes the field of `fixture`'s lamps (surfaces and balls are ignored) over `reach`, which must lie between two
/// flat faces. The grid starts coarse and is halved along its worst axis until the estimated error is below
/// `accuracy`. The same bytes for any number of threads.
/// @throws Error if the scene is faulty, the box is empty, holds a face or a lamp's lens, lies in a light guide's plate
/// or beside its exit face's plane, or the accuracy needs more than most_flows nodes times beams (as a lobe without a
/// soft rim does whose edge crosses the box)
LightField make_light_field(const Scene& fixture, const Eigen::AlignedBox3d& reach,
                            const LightFieldSettings& settings = {});

/// What making a field takes, in places at which the light of all lamps is computed.
struct LightFieldCount {
  double places = 0.0;     ///< of the field; those with absorption count once more a band
  double looked_at = 0.0;  ///< by count_light_field itself: its seconds over this are those of a place
  bool fits = false;       ///< false: make_light_field will fail, after so many
};

/// Counts what make_light_field would do with the same arguments: makes its first grids, and takes the error of finer
/// ones to fall with the square of the step. Where that is near the accuracy it may stop a grid earlier or later.
/// @throws Error as that
LightFieldCount count_light_field(const Scene& fixture, const Eigen::AlignedBox3d& reach,
                                  const LightFieldSettings& settings = {});

/// F of one lamp, all its beams together, at `place` by connections to its lens, as the grid's nodes have it: F and its
/// length. For tests and for error estimates. @pre settings as of make_light_field
Eigen::Vector4d exact_flow(const LightField& field, int lamp, const Eigen::Vector3d& place,
                           const LightFieldSettings& settings = {});

/// The grid cell round a place and its corners' weights, for looking up several values.
struct FieldCell {
  std::array<int, 8> node;
  std::array<float, 8> weight;
};

/// A place outside the box is taken as the nearest one on it.
inline FieldCell find_cell(const LightField& field, float x, float y, float z) {
  const float place[3] = {x, y, z};
  int low[3];
  float share[3];
  for (int a = 0; a < 3; ++a) {
    const auto most = static_cast<float>(field.nodes[a] - 1);
    float t = (place[a] - static_cast<float>(field.reach.min()[a])) / static_cast<float>(field.step[a]);
    t = t > 0.0f ? (t < most ? t : most) : 0.0f;
    low[a] = static_cast<int>(t);
    if (low[a] > field.nodes[a] - 2) low[a] = field.nodes[a] - 2;
    share[a] = t - static_cast<float>(low[a]);
  }
  FieldCell cell;
  const int first = low[0] + field.nodes[0] * (low[1] + field.nodes[1] * low[2]);
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1;
    const int j = (corner >> 1) & 1;
    const int k = corner >> 2;
    cell.node[corner] = first + i + field.nodes[0] * (j + field.nodes[1] * k);
    cell.weight[corner] =
        (i ? share[0] : 1.0f - share[0]) * (j ? share[1] : 1.0f - share[1]) * (k ? share[2] : 1.0f - share[2]);
  }
  return cell;
}

/// All beams' F and length at once: `out` gets 4 floats a beam.
inline void look_up_flow(const LightField& field, const FieldCell& cell, float* out) {
  const int width = 4 * field.beam_count();
  for (int k = 0; k < width; ++k) out[k] = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const float* from = field.flow.data() + static_cast<std::size_t>(cell.node[corner]) * width;
    const float weight = cell.weight[corner];
    for (int k = 0; k < width; ++k) out[k] += weight * from[k];
  }
}

/// One beam's F.
inline Eigen::Vector3f look_up_flow(const LightField& field, const FieldCell& cell, int beam) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const std::size_t at = static_cast<std::size_t>(cell.node[corner]) * field.beam_count() + beam;
    sum += cell.weight[corner] * Eigen::Map<const Eigen::Vector3f>(field.flow.data() + 4 * at);
  }
  return sum;
}

}  // namespace touchstone::render
