#include "fem/mesh/line_grid.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "fem/mesh/line_hit.h"

namespace touchstone::fem {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-11;      // of the largest coordinate
constexpr std::size_t kMostEntries = 8;  // of the number of triangles; long ones lie in many cells
constexpr double kMostAcross = 2048.0;   // cells

int cell_at(double place, double from, double to, int count) {
  const double cell = (place - from) / (to - from) * count;
  return cell > 0.0 ? static_cast<int>(std::min(cell, count - 1.0)) : 0;
}

}  // namespace

LineGrid::LineGrid(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::array<int, 3>>& triangles,
                   const Eigen::Vector3d& direction)
    : direction_(direction) {
  std::tie(first_, second_) = across(direction);
  triangles_.reserve(triangles.size());
  double largest = 0.0;
  for (const auto& index : triangles) {
    Seen seen;
    seen.least = kInfinity;
    for (int c = 0; c < 3; ++c) {
      seen.corners[c] = vertices[index[c]];
      seen.x[c] = first_.dot(seen.corners[c]);
      seen.y[c] = second_.dot(seen.corners[c]);
      seen.least = std::min(seen.least, direction.dot(seen.corners[c]));
      left_ = std::min(left_, seen.x[c]);
      right_ = std::max(right_, seen.x[c]);
      low_ = std::min(low_, seen.y[c]);
      high_ = std::max(high_, seen.y[c]);
      largest = std::max(largest, seen.corners[c].cwiseAbs().maxCoeff());
    }
    triangles_.push_back(seen);
  }
  if (triangles_.empty()) return;
  slack_ = kRounding * (1.0 + largest);
  left_ -= slack_;
  right_ += slack_;
  low_ -= slack_;
  high_ += slack_;
  // As many cells as triangles, as square as they can be.
  const double width = right_ - left_;
  const double height = high_ - low_;
  const auto n = static_cast<double>(triangles_.size());
  double columns = std::clamp(std::sqrt(n * width / height), 1.0, kMostAcross);
  double rows = std::clamp(n / columns, 1.0, kMostAcross);
  while (!sort_into(static_cast<int>(columns), static_cast<int>(rows))) {
    columns = std::max(1.0, 0.5 * columns);
    rows = std::max(1.0, 0.5 * rows);
  }
}

std::array<LineGrid::Range, 2> LineGrid::cells_of(const Seen& triangle) const {
  const auto [left, right] = std::minmax({triangle.x[0], triangle.x[1], triangle.x[2]});
  const auto [low, high] = std::minmax({triangle.y[0], triangle.y[1], triangle.y[2]});
  return {Range{cell_at(left - slack_, left_, right_, columns_), cell_at(right + slack_, left_, right_, columns_)},
          Range{cell_at(low - slack_, low_, high_, rows_), cell_at(high + slack_, low_, high_, rows_)}};
}

bool LineGrid::sort_into(int columns, int rows) {
  columns_ = columns;
  rows_ = rows;
  begin_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) + 1, 0);
  std::size_t entries = 0;
  const std::size_t most = columns == 1 && rows == 1 ? triangles_.size() : kMostEntries * triangles_.size();
  const auto visit = [&](const Seen& triangle, const auto& cell) {
    const auto [across, up] = cells_of(triangle);
    for (int row = up.from; row <= up.to; ++row) {
      for (int column = across.from; column <= across.to; ++column) cell(row * columns + column);
    }
  };
  for (const Seen& triangle : triangles_) {
    const auto [across, up] = cells_of(triangle);
    entries += static_cast<std::size_t>(across.to - across.from + 1) * static_cast<std::size_t>(up.to - up.from + 1);
    if (entries > most) return false;
    visit(triangle, [&](int cell) { ++begin_[cell + 1]; });
  }
  for (std::size_t k = 1; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
  entries_.resize(entries);
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    visit(triangles_[t], [&](int cell) { entries_[next[cell]++] = static_cast<int>(t); });
  }
  return true;
}

std::optional<double> LineGrid::nearest(const Eigen::Vector3d& point, bool any) const {
  const double px = first_.dot(point);
  const double py = second_.dot(point);
  if (!(px >= left_ && px <= right_ && py >= low_ && py <= high_)) return std::nullopt;
  const double here = direction_.dot(point);
  const int cell = cell_at(py, low_, high_, rows_) * columns_ + cell_at(px, left_, right_, columns_);
  double along = kInfinity;
  for (int k = begin_[cell]; k < begin_[cell + 1]; ++k) {
    const Seen& triangle = triangles_[entries_[k]];
    if (triangle.least - here - slack_ > along) continue;
    const std::array<double, 3> x{triangle.x[0] - px, triangle.x[1] - px, triangle.x[2] - px};
    const std::array<double, 3> y{triangle.y[0] - py, triangle.y[1] - py, triangle.y[2] - py};
    if (const auto hit = hit_in(x, y)) {
      along = std::min(along, distance_to(*hit, triangle.corners, point, direction_));
      if (any) break;
    }
  }
  return along < kInfinity ? std::optional<double>(along) : std::nullopt;
}

}  // namespace touchstone::fem
