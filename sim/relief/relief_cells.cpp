#include "sim/relief/relief_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"

namespace touchstone::sim {
namespace {

int wrapped(int i, int n) {
  i %= n;
  return i < 0 ? i + n : i;
}

/// The shortest offset between two places of a periodic rectangle.
Eigen::Vector2d nearest_offset(const Eigen::Vector2d& offset, const Eigen::Vector2d& size) {
  return {offset.x() - size.x() * std::round(offset.x() / size.x()),
          offset.y() - size.y() * std::round(offset.y() / size.y())};
}

int bucket_of(double place, double size, int count) {
  return wrapped(static_cast<int>(std::floor(place / size * count)), count);
}

}  // namespace

std::vector<Eigen::Vector2d> scatter(const Eigen::Vector2d& size, double per_mm2, double closeness,
                                     RandomStream& random) {
  constexpr int kTries = 30;
  const int count = std::max(4, static_cast<int>(std::lround(per_mm2 * size.x() * size.y())));
  const double least = closeness * std::sqrt(size.x() * size.y() / count);
  // Buckets as wide as the least distance, so that only the eight about one need be asked.
  const int columns = std::max(1, static_cast<int>(size.x() / std::max(least, 1e-3 * size.x())));
  const int rows = std::max(1, static_cast<int>(size.y() / std::max(least, 1e-3 * size.y())));
  std::vector<std::vector<int>> buckets(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  std::vector<Eigen::Vector2d> points;
  const auto fits = [&](const Eigen::Vector2d& place) {
    const int column = bucket_of(place.x(), size.x(), columns), row = bucket_of(place.y(), size.y(), rows);
    for (int j = row - 1; j <= row + 1; ++j) {
      for (int i = column - 1; i <= column + 1; ++i) {
        for (const int k : buckets[static_cast<std::size_t>(wrapped(j, rows)) * columns + wrapped(i, columns)]) {
          if (nearest_offset(place - points[k], size).squaredNorm() < least * least) return false;
        }
      }
    }
    return true;
  };
  while (static_cast<int>(points.size()) < count) {
    Eigen::Vector2d place;
    for (int t = 0; t < kTries; ++t) {
      place = {size.x() * random.uniform(), size.y() * random.uniform()};
      if (fits(place)) break;
    }
    const auto bucket = static_cast<std::size_t>(bucket_of(place.y(), size.y(), rows)) * columns +
                        static_cast<std::size_t>(bucket_of(place.x(), size.x(), columns));
    buckets[bucket].push_back(static_cast<int>(points.size()));
    points.push_back(place);
  }
  return points;
}

CellDiagram::CellDiagram(const Eigen::Vector2d& size, std::vector<CellPoint> points)
    : size_(size), points_(std::move(points)) {
  TS_ASSERT(points_.size() >= 4);
  const double spacing = std::sqrt(size.x() * size.y() / static_cast<double>(points_.size()));
  columns_ = std::max(1, static_cast<int>(size.x() / spacing));
  rows_ = std::max(1, static_cast<int>(size.y() / spacing));
  buckets_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const int column = bucket_of(points_[k].place.x(), size_.x(), columns_);
    const int row = bucket_of(points_[k].place.y(), size_.y(), rows_);
    buckets_[static_cast<std::size_t>(row) * columns_ + column].push_back(static_cast<int>(k));
  }
}

CellPlace CellDiagram::at(const Eigen::Vector2d& place) const {
  struct Near {
    double power = std::numeric_limits<double>::infinity();
    int point = -1;
    Eigen::Vector2d offset = Eigen::Vector2d::Zero();  // from the place to the point
  };
  constexpr std::size_t kNearest = 6;  // by power; of these the walls' distances are compared
  std::array<Near, kNearest> nearest;
  const int column = bucket_of(place.x(), size_.x(), columns_), row = bucket_of(place.y(), size_.y(), rows_);
  // Two buckets on each side, but none twice.
  const int left = -std::min(2, (columns_ - 1) / 2), right = std::min(2, columns_ / 2);
  const int low = -std::min(2, (rows_ - 1) / 2), high = std::min(2, rows_ / 2);
  for (int j = low; j <= high; ++j) {
    for (int i = left; i <= right; ++i) {
      const int bucket = wrapped(row + j, rows_) * columns_ + wrapped(column + i, columns_);
      for (const int k : buckets_[bucket]) {
        const Eigen::Vector2d offset = nearest_offset(points_[k].place - place, size_);
        const double power = offset.squaredNorm() - points_[k].weight;
        if (power >= nearest.back().power) continue;
        std::size_t at = kNearest - 1;
        for (; at > 0 && nearest[at - 1].power > power; --at) nearest[at] = nearest[at - 1];
        nearest[at] = {power, k, offset};
      }
    }
  }
  TS_ASSERT(nearest[1].point >= 0);
  CellPlace result;
  result.cell = nearest[0].point;
  result.from_point = -nearest[0].offset;
  result.wall = result.second_wall = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < kNearest && nearest[k].point >= 0; ++k) {
    const double apart = std::max((nearest[k].offset - nearest[0].offset).norm(), 1e-9);
    const double wall = 0.5 * (nearest[k].power - nearest[0].power) / apart;
    if (wall < result.wall) {
      result.second_wall = result.wall;
      result.wall = wall;
      result.neighbour = nearest[k].point;
    } else {
      result.second_wall = std::min(result.second_wall, wall);
    }
  }
  return result;
}

}  // namespace touchstone::sim
