#include "sensors/colour/hue.h"

#include <algorithm>
#include <cmath>

namespace touchstone::sensors {

namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

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
