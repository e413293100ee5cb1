#include "sim/scene/contact_pressure.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace touchstone::sim {

std::vector<double> ContactPressure::on_grid(const Eigen::Vector2d& low, double pixel_mm, int columns, int rows) const {
  std::vector<double> out(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0.0);
  // Pixel indices of the first middle at or after a place, and of the last one at or before it.
  const auto first = [&](double mm, int axis, int count) {
    return std::clamp(static_cast<int>(std::ceil((mm - low[axis]) / pixel_mm - 0.5)), 0, count);
  };
  const auto last = [&](double mm, int axis, int count) {
    return std::clamp(static_cast<int>(std::floor((mm - low[axis]) / pixel_mm - 0.5)), -1, count - 1);
  };
  for (const std::array<int, 3>& t : triangles) {
    if (std::max({kPa[t[0]], kPa[t[1]], kPa[t[2]]}) <= 0.0) continue;
    const Eigen::Vector2d& a = places[t[0]];
    const Eigen::Vector2d& b = places[t[1]];
    const Eigen::Vector2d& c = places[t[2]];
    Eigen::Matrix2d sides;
    sides << b - a, c - a;
    if (sides.determinant() == 0.0) continue;  // seen edge on
    const Eigen::Matrix2d weights = sides.inverse();
    const Eigen::Vector2d from = a.cwiseMin(b).cwiseMin(c);
    const Eigen::Vector2d to = a.cwiseMax(b).cwiseMax(c);
    const int right = last(to.x(), 0, columns);
    const int top = last(to.y(), 1, rows);
    for (int row = first(from.y(), 1, rows); row <= top; ++row) {
      for (int column = first(from.x(), 0, columns); column <= right; ++column) {
        const Eigen::Vector2d middle = low + pixel_mm * Eigen::Vector2d(column + 0.5, row + 0.5);
        const Eigen::Vector2d w = weights * (middle - a);
        if (w.minCoeff() < 0.0 || w.sum() > 1.0) continue;
        out[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)] =
            (1.0 - w.sum()) * kPa[t[0]] + w[0] * kPa[t[1]] + w[1] * kPa[t[2]];
      }
    }
  }
  return out;
}

}  // namespace touchstone::sim
