#pragma once
// Refusals of settings that aren't numbers of the range that most must have.

#include <cmath>
#include <string_view>

#include "core/error.h"

namespace touchstone {

/// `whose` begins the message and ends with what separates it from the name: "the finger's ", "collision: ", "".
/// @throws Error "<whose><name> is <value>, it must be above 0 and finite"
inline void check_above_zero(std::string_view whose, double value, std::string_view name) {
  if (!(value > 0.0) || !std::isfinite(value)) fail("{}{} is {}, it must be above 0 and finite", whose, name, value);
}

/// @throws Error "<whose><name> is <value>, it must be at least 0 and finite"
inline void check_at_least_zero(std::string_view whose, double value, std::string_view name) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    fail("{}{} is {}, it must be at least 0 and finite", whose, name, value);
  }
}

}  // namespace touchstone
