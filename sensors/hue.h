#pragma once

#include <Eigen/Core>

namespace touchstone::sensors {

/// cos and sin of a pixel's hue in the HSV hexagon: 0 is red, 2 pi / 3 green. Right to 5e-6.
/// @pre the channels aren't all one value
Eigen::Vector2d hue_direction(double blue, double green, double red);

/// The hue of a sum of directions, radians in [0, 2 pi): their circular mean. @pre direction isn't zero
double hue_of(const Eigen::Vector2d& direction);

/// `hue` less `from` the short way round, radians in (-pi, pi].
double hue_difference(double hue, double from);

}  // namespace touchstone::sensors
