#pragma once
// Explore mode's relative estimate [Knoop2013, eqs. 3 and 4]: the dilation and the shift between two pictures that
// follow each other, by least squares on the optical flow equation.

#include <optional>

#include "sensors/reflex/dots_motion.h"
#include "sensors/reflex/dots_picture.h"

namespace touchstone::sensors {

/// How the flow equation is solved.
struct DotsFlowSettings {
  /// 1: the paper's, one linear solution. More: the second picture is warped back by what was found and looked at
  /// again, so that steps of a pixel have no bias.
  int rounds = 1;
  /// Let the light change by a factor and an offset, as it does when the skin comes nearer to the lamps; the paper's
  /// equation has none.
  bool free_light = false;
  double most_step_px = 3.0;  ///< what isn't believed, at the picture's edge
};

/// The motion from `before` to `now`, sought from `start` on. Nothing where the pictures don't determine it (no
/// gradients), or what was found isn't believed.
/// @throws Error for settings out of range or pictures of different sizes
std::optional<DotsMotion> dots_flow(const DotsPicture& before, const DotsPicture& now,
                                    const DotsFlowSettings& settings = {}, const DotsMotion& start = {});

}  // namespace touchstone::sensors
