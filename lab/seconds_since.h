#pragma once

#include <chrono>

namespace touchstone::lab {

/// Of wall time, for what rows took.
inline double seconds_since(std::chrono::steady_clock::time_point begun) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace touchstone::lab
