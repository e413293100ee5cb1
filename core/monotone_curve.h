#pragma once
// A smooth curve through measured points.

#include <Eigen/Core>
#include <vector>

namespace touchstone {

/// A curve through points (x, y) that rises and falls only where they do: between each two a cubic, with the slopes of
/// [Fritsch1984] at the points and, at the two ends, that of the parabola through three of them, kept from turning
/// back. Beyond the ends it goes on straight.
class MonotoneCurve {
 public:
  /// The line y = x.
  MonotoneCurve() : MonotoneCurve(std::vector<Eigen::Vector2d>{{0.0, 0.0}, {1.0, 1.0}}) {}
  /// @throws Error for fewer than two points, numbers that aren't finite, or an x that isn't above the one before it
  explicit MonotoneCurve(const std::vector<Eigen::Vector2d>& points);

  double at(double x) const;  ///< the curve's y there
  const std::vector<Eigen::Vector2d>& points() const { return points_; }

 private:
  std::vector<Eigen::Vector2d> points_;
  std::vector<double> slopes_;  // at the points
};

}  // namespace touchstone
