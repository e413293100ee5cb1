#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace touchstone::sensors {

/// cos and sin of a pixel's hue in the HSV hexagon: 0 is red, 2 pi / 3 green. Right to 5e-6.
/// @pre the channels aren't all one value
inline Eigen::Vector2d hue_direction(double blue, double green, double red) {
  const double highest = std::max({blue, green, red});
  const double lowest = std::min({blue, green, red});
  constexpr double kThird = 1.04719755119659774615;     // pi / 3
  constexpr double kSinThird = 0.86602540378443864676;  // of 2 pi / 3
  // Each side of red, green and blue is a sixth of the circle, in which short series do.
  double base_cos = 1.0, base_sin = 0.0;
  double side = green - blue;
  if (highest > red) {
    base_cos = -0.5;
    base_sin = highest == green ? kSinThird : -kSinThird;
    side = highest == green ? blue - red : red - green;
  }
  const double t = kThird * side / (highest - lowest);
  const double q = t * t;
  const double sine = t * (1.0 - q * (1.0 / 6.0) * (1.0 - q * (1.0 / 20.0) * (1.0 - q * (1.0 / 42.0))));
  const double cosine = 1.0 - q * 0.5 * (1.0 - q * (1.0 / 12.0) * (1.0 - q * (1.0 / 30.0) * (1.0 - q * (1.0 / 56.0))));
  return {base_cos * cosine - base_sin * sine, base_sin * cosine + base_cos * sine};
}

/// The hue of a sum of directions, radians in [0, 2 pi): their circular mean. @pre direction isn't zero
double hue_of(const Eigen::Vector2d& direction);

/// `hue` less `from` along the shorter arc, radians in (-pi, pi].
double hue_difference(double hue, double from);

}  // namespace touchstone::sensors
