#pragma once
// Rows and rings of LEDs, each a little unlike the next.
//
//   for (const LedLamp& led : led_strip(like, {-6, -8, -7}, {6, -8, -7}, 8, {.seed = 3, .power = 0.1}))
//   scene.lamps.push_back(led);

#include <cstdint>
#include <vector>

#include "render/scene/lamp.h"

namespace touchstone::render {

/// How LEDs of one kind differ. A pure function of the seed and the LED's number: `power` is the standard deviation of
/// the logarithm of an LED's power (its mean power stays that of the type), `tilt` that of the angles by which its axis
/// leans (rad, about each of two axes; at most 0.5). 0 and 0 are LEDs all alike.
struct LedSpread {
  std::uint64_t seed = 0;
  double power = 0.0;
  double tilt = 0.0;
};

/// `count` LEDs like `like` (its power is that of each) at equal distances on the line `from` to `to`, the first and
/// last at its ends; one LED stands in the middle.
/// @throws Error for a count below 1 or over 1000, ends that aren't finite or a spread out of its range
std::vector<LedLamp> led_strip(const LedLamp& like, const Eigen::Vector3d& from, const Eigen::Vector3d& to, int count,
                               const LedSpread& spread = {});

/// `count` LEDs on a level circle about `centre`, all turned towards the point `aim`; the first at azimuth 0.
/// @throws Error as led_strip, and for a radius that isn't above 0
std::vector<LedLamp> led_ring(const LedLamp& like, const Eigen::Vector3d& centre, double radius,
                              const Eigen::Vector3d& aim, int count, const LedSpread& spread = {});

/// Columns x rows LEDs on the parallelogram with the corner `corner` and the sides `side_a` (columns) and `side_b`
/// (rows), in the middles of equal cells, row by row.
/// @throws Error as led_strip
std::vector<LedLamp> led_array(const LedLamp& like, const Eigen::Vector3d& corner, const Eigen::Vector3d& side_a,
                               const Eigen::Vector3d& side_b, int columns, int rows, const LedSpread& spread = {});

}  // namespace touchstone::render
