#pragma once
// Frames of pressed balls, as the calibrations of heights take them.

#include <functional>
#include <optional>
#include <vector>

#include "python/src/convert.h"
#include "sensors/heights/ball_press.h"

namespace touchstone::python {

/// What a caller has given.
struct GivenPresses {
  std::vector<Picture> pictures;
  std::vector<double> radii_mm;                                ///< of the balls, one a picture
  std::vector<std::optional<sensors::ContactCircle>> circles;  ///< likewise; nothing: to be found

  using Find = std::function<sensors::ContactCircle(const sensors::BallPress&)>;
  /// The presses; circles that weren't given are those that `find` gives, or without it absent.
  std::vector<sensors::BallPress> presses(const Find& find = {}) const;
};

/// Frames, one diameter each, and for each (u, v, radius) in pixels or None; `circles` may be None.
/// @throws Error naming the argument
GivenPresses presses_from(const py::object& frames, const py::object& ball_diameters_mm, const py::object& circles);

/// @throws Error unless `mm_per_px` is allowed
void require_scale(double mm_per_px);

}  // namespace touchstone::python
