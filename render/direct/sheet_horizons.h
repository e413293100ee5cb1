#pragma once
// Where a sheet hides from itself the light that comes to it from one side.

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "core/triangle_mesh.h"
#include "render/direct/light_field.h"

namespace touchstone::render {

/// Where horizons are to be found, and how finely.
struct HorizonSettings {
  float side = -1.0f;        ///< 1: light comes from above (z grows towards it), -1: from below
  float flattest = 0.1f;     ///< tangent of the elevation of the flattest light, above 0
  float pitch = 0.05f;       ///< mm, between the places where horizons are found, on and close to what is steep
  int far_pitches = 3;       ///< farther away they are found so much more widely
  int most_places = 512;     ///< a side: pitches are made wider for more
  Eigen::AlignedBox2d seen;  ///< x and y of the places that will be asked for; empty: all
};

/// The side that all of a field's light comes from where rays pass `seen` (x and y), and how flat the flattest is, the
/// lower edge of its beams counted (see DirectBatch). nullopt where light comes from both sides, or level.
std::optional<HorizonSettings> flattest_light(const LightField& field, const Eigen::AlignedBox2d& seen);

/// How high the sheet itself stands before the light from all sides, over two grids of places, near and far, and over
/// azimuths: what is flatter doesn't reach the place. Found line by line along each azimuth: of what lies ahead on a
/// line only the upper convex hull can be a horizon, and going along it costs a constant time a place ([Timonen2010]).
///
/// Azimuths are counted by the perimeter of the square |x| + |y| = 1, which takes no trigonometric function: 0 to 4,
/// from the direction of x by that of y.
class SheetHorizons {
 public:
  static constexpr int kAzimuths = 32;

  /// nullopt where the sheet isn't a height field over x and y: then some light has to be asked for by rays.
  static std::optional<SheetHorizons> find(const TriangleMesh& sheet, const HorizonSettings& settings);

  /// Is there any light not flatter than the flattest one that may be hidden from here?
  bool any(float x, float y) const {
    const Grid& grid = near_.holds(x, y) ? near_ : far_;
    return grid.holds(x, y) && grid.shaded[grid.nearest(x, y)] != 0;
  }

  /// Numbers that at() gives: the last azimuth's first, then all, then the first two's again.
  static constexpr int kAround = kAzimuths + 3;
  /// The horizons' tangents at a place, by azimuth. `out` has space for kAround.
  void at(float x, float y, float* out) const;

  static float azimuth(float x, float y) {  ///< of a direction, 0 to 4
    const float across = (x < 0.0f ? -x : x) + (y < 0.0f ? -y : y);
    const float share = across > 0.0f ? y / across : 0.0f;
    if (x < 0.0f) return 2.0f - share;
    return share < 0.0f ? 4.0f + share : share;
  }

  /// The unit vector of an azimuth from -4 to 8.
  static Eigen::Vector2f heading(float azimuth);

  /// Where an azimuth lies between those that horizons are found for: the first of four of at()'s numbers round it, and
  /// its share of the way from the second to the third.
  struct Between {
    int low;
    float share;
  };
  /// @pre `azimuth` from -4 to 8
  static Between between(float azimuth) {
    float place = azimuth * (0.25f * kAzimuths);
    if (place < 0.0f) place += kAzimuths;
    if (place >= kAzimuths) place -= kAzimuths;
    int low = static_cast<int>(place);
    if (low < 0) low = 0;
    if (low > kAzimuths - 1) low = kAzimuths - 1;
    return {low, place - static_cast<float>(low)};
  }

  /// Cubic splines through the horizons of four azimuths ([Catmull1974]): what stands out from the sheet is as narrow
  /// as a few azimuths, and straight lines would cut its top off.
  static float spline(float p0, float p1, float p2, float p3, float t) {
    return p1 + 0.5f * t * (p2 - p0 + t * (2.0f * p0 - 5.0f * p1 + 4.0f * p2 - p3 + t * (3.0f * (p1 - p2) + p3 - p0)));
  }

 private:
  struct Grid {
    float left = 0.0f, bottom = 0.0f, pitch = 1.0f;
    int columns = 0, rows = 0;    // 0: there is none
    std::vector<float> horizons;  // [row][column][azimuth]
    std::vector<char> shaded;     // by place: it or one beside it has a horizon above the flattest light

    Grid() = default;
    Grid(const TriangleMesh& sheet, const HorizonSettings& settings, const Eigen::AlignedBox2d& box, float pitch_mm);
    bool holds(float x, float y) const {
      return x >= left && y >= bottom && x <= left + pitch * static_cast<float>(columns - 1) &&
             y <= bottom + pitch * static_cast<float>(rows - 1);
    }
    std::size_t nearest(float x, float y) const {
      return static_cast<std::size_t>((y - bottom) / pitch + 0.5f) * static_cast<std::size_t>(columns) +
             static_cast<std::size_t>((x - left) / pitch + 0.5f);
    }
    /// Heights at the places, each line with its ends once more: [row][column], [column][row].
    struct Heights {
      std::vector<float> by_row, by_column;
    };
    /// One azimuth's horizons, at all places.
    void sweep(const Heights& heights, int number, float* plane) const;
  };

  Grid near_, far_;
};

}  // namespace touchstone::render
