#pragma once
// Forces of presses that differ in how fast they rise and in what rings, as those of pieces of several softness do.

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/random.h"
#include "core/units.h"

namespace touchstone::sensors::fixtures {

/// 1.2 s at `rate_Hz`, the touch after 0.2 s. @param level from 0, soft, on: rises faster, rings higher
inline std::vector<double> invented_press(int level, int number, double rate_Hz) {
  RandomStream random(static_cast<std::uint64_t>(number), static_cast<std::uint64_t>(level), Purpose::kTest);
  const double rise_s = 0.3 / (1.0 + level) * (0.9 + 0.2 * random.uniform());
  const double ring_Hz = 20.0 + 25.0 * level * (0.95 + 0.1 * random.uniform());
  const double end_N = 2.0 + 0.4 * random.uniform();
  std::vector<double> force_N;
  for (int i = 0; i < static_cast<int>(1.2 * rate_Hz); ++i) {
    const double since_s = i / rate_Hz - 0.2;
    double force = 0.0;
    if (since_s > 0.0) {
      force = end_N * (1.0 - std::exp(-since_s / rise_s)) +
              0.15 * std::exp(-since_s / 0.15) * std::sin(2.0 * kPi * ring_Hz * since_s);
    }
    force_N.push_back(force + 0.01 * random.normal());
  }
  return force_N;
}

}  // namespace touchstone::sensors::fixtures
