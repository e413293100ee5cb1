#pragma once
// Several numbers of one stream at once. In one expression, as in Vector2d(random.normal(), random.normal()), C++
// leaves open which comes first, and compilers differ; here the order is fixed, and so are the bytes of data sets.

#include <Eigen/Core>
#include <cstdint>

#include "core/random.h"

namespace touchstone {

/// 64 bits for another stream's seed; the upper half is drawn first.
inline std::uint64_t next_seed(RandomStream& random) {
  const std::uint64_t high = random();
  return (high << 32) | random();
}

/// Two standard normal numbers, y drawn before x.
inline Eigen::Vector2d normal_pair(RandomStream& random) {
  const double y = random.normal();
  const double x = random.normal();
  return {x, y};
}

/// Two numbers uniform in [0, 1), y drawn before x.
inline Eigen::Vector2d uniform_pair(RandomStream& random) {
  const double y = random.uniform();
  const double x = random.uniform();
  return {x, y};
}

}  // namespace touchstone
