#pragma once
// Boxes of pixels over the gel, and what stands on their grids.

#include <vector>

#include "fem/fine_relief/layer_response.h"

namespace touchstone::fem {

/// Whole pixels of the lattice whose centres stand at (i + 0.5) * pitch; all are inclusive.
struct PixelBox {
  int left, bottom, right, top;

  /// Its pixels.
  PixelGrid grid(double pitch) const {
    return {right - left + 1, top - bottom + 1, pitch, pitch * Eigen::Vector2d(left + 0.5, bottom + 0.5)};
  }
  bool operator==(const PixelBox&) const = default;
};

/// The pixels that hold the two corners, and all between.
PixelBox box_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double pitch);

/// What both have; a side ends before it begins where that is nothing.
PixelBox common(const PixelBox& a, const PixelBox& b);

/// The box widened to one of few sizes, each a sixth more than the one before, so that their responses are kept from
/// press to press (SmoothSurface::response); not beyond `whole`.
PixelBox of_kept_size(const PixelBox& box, const PixelBox& whole);

/// The box with those sides moved out that contact has come near to. `pressure` is by pixel of the box.
PixelBox widened(const PixelBox& box, const PixelGrid& grid, const std::vector<double>& pressure);

/// Numbers by pixel of one grid, by pixel of another one of the same lattice; `elsewhere` where the first has none.
std::vector<double> on_grid(const PixelGrid& from, const std::vector<double>& values, const PixelGrid& to,
                            double elsewhere);

}  // namespace touchstone::fem
