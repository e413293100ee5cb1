#include "core/monotone_curve.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone {
namespace {

/// The slope at a point between two chords, the weighted harmonic mean of theirs. `width`: of their intervals.
double inner_slope(double width_0, double width_1, double chord_0, double chord_1) {
  if (!(chord_0 * chord_1 > 0.0)) return 0.0;
  const double weight_0 = 2.0 * width_1 + width_0;
  const double weight_1 = width_1 + 2.0 * width_0;
  return (weight_0 + weight_1) / (weight_0 / chord_0 + weight_1 / chord_1);
}

/// The slope at an end, whose chord is the first one.
double end_slope(double width_0, double width_1, double chord_0, double chord_1) {
  const double slope = ((2.0 * width_0 + width_1) * chord_0 - width_0 * chord_1) / (width_0 + width_1);
  if (!(slope * chord_0 > 0.0)) return 0.0;
  if (chord_0 * chord_1 < 0.0 && std::abs(slope) > 3.0 * std::abs(chord_0)) return 3.0 * chord_0;
  return slope;
}

}  // namespace

MonotoneCurve::MonotoneCurve(const std::vector<Eigen::Vector2d>& points) : points_(points) {
  if (points.size() < 2) fail("a curve of {} points; at least 2 are needed", points.size());
  std::vector<double> widths;
  std::vector<double> chords;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) {
      fail("point {} of a curve is ({}, {}); both must be finite", i + 1, points[i].x(), points[i].y());
    }
    if (i == 0) continue;
    widths.push_back(points[i].x() - points[i - 1].x());
    if (!(widths.back() > 0.0)) {
      fail("point {} of a curve is at {}; it must be above the one before it, {}", i + 1, points[i].x(),
           points[i - 1].x());
    }
    chords.push_back((points[i].y() - points[i - 1].y()) / widths.back());
  }
  const std::size_t last = chords.size() - 1;
  if (last == 0) {
    slopes_ = {chords[0], chords[0]};
    return;
  }
  slopes_.push_back(end_slope(widths[0], widths[1], chords[0], chords[1]));
  for (std::size_t i = 0; i < last; ++i) {
    slopes_.push_back(inner_slope(widths[i], widths[i + 1], chords[i], chords[i + 1]));
  }
  slopes_.push_back(end_slope(widths[last], widths[last - 1], chords[last], chords[last - 1]));
}

double MonotoneCurve::at(double x) const {
  if (x <= points_.front().x()) return points_.front().y() + slopes_.front() * (x - points_.front().x());
  if (x >= points_.back().x()) return points_.back().y() + slopes_.back() * (x - points_.back().x());
  const auto after = std::upper_bound(points_.begin(), points_.end(), x,
                                      [](double value, const Eigen::Vector2d& point) { return value < point.x(); });
  const auto i = static_cast<std::size_t>(after - points_.begin()) - 1;
  const double width = points_[i + 1].x() - points_[i].x();
  const double t = (x - points_[i].x()) / width;
  const double rest = 1.0 - t;
  // Hermite's form of the cubic.
  return rest * rest * (1.0 + 2.0 * t) * points_[i].y() + t * t * (3.0 - 2.0 * t) * points_[i + 1].y() +
         width * t * rest * (rest * slopes_[i] - t * slopes_[i + 1]);
}

}  // namespace touchstone
