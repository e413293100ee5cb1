#include "sensors/hue.h"

#include <algorithm>
#include <cmath>

namespace touchstone::sensors {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSinThird = 0.86602540378443864676;  ///< of 2 pi / 3

}  // namespace

Eigen::Vector2d hue_direction(double blue, double green, double red) {
  const double highest = std::max({blue, green, red});
  const double lowest = std::min({blue, green, red});
  // Each side of red, green and blue is a sixth of the circle, in which short series do.
  double base_cos = 1.0, base_sin = 0.0;
  double side = green - blue;
  if (highest > red) {
    base_cos = -0.5;
    base_sin = highest == green ? kSinThird : -kSinThird;
    side = highest == green ? blue - red : red - green;
  }
  const double t = kPi / 3.0 * side / (highest - lowest);
  const double q = t * t;
  const double sine = t * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0)));
  const double cosine = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0)));
  return {base_cos * cosine - base_sin * sine, base_sin * cosine + base_cos * sine};
}

double hue_of(const Eigen::Vector2d& direction) {
  const double angle = std::atan2(direction.y(), direction.x());
  // A tiny negative angle plus the whole circle rounds to the whole circle.
  return angle >= 0.0 ? angle : std::fmod(angle + 2.0 * kPi, 2.0 * kPi);
}

double hue_difference(double hue, double from) {
  const double turned = std::remainder(hue - from, 2.0 * kPi);
  return turned == -kPi ? kPi : turned;
}

}  // namespace touchstone::sensors
