#pragma once
// Parts of a straight line p + t d that lie within simple bounds.

#include <Eigen/Core>
#include <limits>

namespace touchstone::fem {

/// From t = `enter` to t = `leave`; the whole line to begin with.
struct LineInterval {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  bool empty() const { return enter > leave; }
};

/// The part of the line in both; empty if there is none.
LineInterval common(const LineInterval& a, const LineInterval& b);

/// Where low <= coordinate <= high, for a coordinate start + t slope.
LineInterval between(double low, double high, double start, double slope);

/// Inside the ball of `radius` about the origin. @pre d is a unit vector
LineInterval inside_ball(double radius, const Eigen::Vector3d& p, const Eigen::Vector3d& d);

/// Inside the endless cylinder of `radius` about z.
LineInterval inside_cylinder(double radius, const Eigen::Vector3d& p, const Eigen::Vector3d& d);

}  // namespace touchstone::fem
