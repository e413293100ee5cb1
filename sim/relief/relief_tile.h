#pragma once
// A rectangle of heights that is repeated without end, and what procedural surfaces are made of: random fields and
// stamped bodies, all of which wrap round its sides. One period of a procedural relief.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/random.h"
#include "fem/shapes/relief_map.h"

namespace touchstone::sim {

/// Distance of a tile's points at most, mm: somewhat below a pixel of the cameras that look at textures.
inline constexpr double kTilePitch = 0.02;
/// The finest detail that such a tile can show, mm.
inline constexpr double kTileDetail = 3.0 * kTilePitch;

/// Heights at the points of one period.
struct ReliefTile {
  int nx = 0;
  int ny = 0;
  Eigen::Vector2d spacing;     ///< mm, of points along x and y; the period is (nx, ny) times this
  std::vector<float> heights;  ///< mm, x fastest

  /// Of one height everywhere. @pre both sides are above 0
  ReliefTile(Eigen::Vector2d size_mm, float height);

  Eigen::Vector2d size() const { return {nx * spacing.x(), ny * spacing.y()}; }
  /// Index of point (i, j), which may lie in any period.
  std::size_t at(int i, int j) const { return static_cast<std::size_t>(wrapped(j, ny)) * nx + wrapped(i, nx); }

  /// Raises the surface to `height_at(offset)` wherever that is above it, in a square of half side `reach` (mm, below
  /// half the period) about `centre`; `offset` is the place as seen from `centre`, mm.
  template <typename HeightAt>
  void raise(const Eigen::Vector2d& centre, double reach, HeightAt&& height_at) {
    visit(centre, reach, [&](float& height, const Eigen::Vector2d& offset) {
      height = std::max(height, static_cast<float>(height_at(offset)));
    });
  }

  /// Calls `change(height, offset)` for each point in that square.
  template <typename Change>
  void visit(const Eigen::Vector2d& centre, double reach, Change&& change) {
    const int left = static_cast<int>(std::ceil((centre.x() - reach) / spacing.x()));
    const int right = static_cast<int>(std::floor((centre.x() + reach) / spacing.x()));
    const int low = static_cast<int>(std::ceil((centre.y() - reach) / spacing.y()));
    const int high = static_cast<int>(std::floor((centre.y() + reach) / spacing.y()));
    for (int j = low; j <= high; ++j) {
      for (int i = left; i <= right; ++i) {
        change(heights[at(i, j)], Eigen::Vector2d(i * spacing.x() - centre.x(), j * spacing.y() - centre.y()));
      }
    }
  }

  /// The lowest point becomes 0.
  fem::ReliefMap map() const;

 private:
  static int wrapped(int i, int n) {
    i %= n;
    return i < 0 ? i + n : i;
  }
};

/// A stream for the `part`-th kind of random thing in the relief of a seed.
RandomStream relief_stream(std::uint64_t seed, std::uint64_t part);

/// A Gaussian random field on the tile's points with mean 0 and a mean square of 1; `power` gives its power spectrum
/// but for a factor, at a wave vector in 1/mm (cycles, not radians). It wraps round.
std::vector<float> random_field(const ReliefTile& tile, const std::function<double(const Eigen::Vector2d&)>& power,
                                RandomStream& random);

/// The same with a Gaussian correlation exp(-(x/lx)^2 - (y/ly)^2), `lengths` in mm.
std::vector<float> smooth_field(const ReliefTile& tile, const Eigen::Vector2d& lengths, RandomStream& random);

/// Adds `amplitude` (mm, root mean square) of smooth_field() of this correlation length. Nothing for an amplitude of 0.
void roughen(ReliefTile& tile, double amplitude, double length, RandomStream& random);

/// The heights blurred by a Gaussian of this standard deviation, mm.
std::vector<float> blurred(const ReliefTile& tile, double deviation);

/// A smooth random function of a place on a closed line of length `period`, with mean 0 and root mean square 1 over the
/// random functions, and hardly any detail below `length`. @pre 0 < length < period
std::function<double(double)> random_wave(double period, double length, RandomStream& random);

}  // namespace touchstone::sim
