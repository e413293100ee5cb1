#pragma once
// What is true at one frame of a played motion.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fem/contact/press.h"
#include "fem/error/press_error.h"

namespace touchstone::sim {

/// A state some time after a frame's begin.
struct LaterState {
  double after_s = 0.0;
  std::shared_ptr<const fem::PressState> press;
};

/// What is true at one frame, at the begin of its exposure.
struct Truth {
  int frame = 0;
  std::int64_t t_us = 0;
  fem::PressState press;
  fem::PressError error;          ///< what the mesh makes of it
  std::vector<LaterState> later;  ///< where the plan has motion blur or a rolling shutter: the states on from there,
                                  ///< in order, to the first at or after the exposure's end or the motion's end
};

/// The one whose gel is pressed deepest. @pre there is one
const Truth& deepest(std::span<const Truth> truths);

}  // namespace touchstone::sim
