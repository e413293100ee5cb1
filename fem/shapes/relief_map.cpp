#include "fem/shapes/relief_map.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr int kPointsAWidth = 8;   // of a blurred map
constexpr int kMostSamples = 256;  // of the window, along an axis
constexpr int kMostPoints = 1 << 26;

/// Index and place between it and the next. Finite axes: -1 to n - 1; the points outside count as zero.
struct Cell {
  int low, high;
  double t;
};

Cell cell(double x, int n, bool repeated) {
  if (repeated) {
    x -= n * std::floor(x / n);
    const int low = std::min(static_cast<int>(x), n - 1);
    return {low, (low + 1) % n, x - low};
  }
  if (!(x > -1.0 && x < n)) return {-1, -1, 0.0};
  const int low = static_cast<int>(std::floor(x));
  return {low, low + 1 < n ? low + 1 : -1, x - low};
}

/// Offsets and weights of a triangular window sampled every `step` or finer.
std::vector<std::pair<double, double>> window(double width, double step) {
  const int half = std::clamp(static_cast<int>(std::ceil(2.0 * width / step)), 4, kMostSamples / 2);
  std::vector<std::pair<double, double>> samples;
  double sum = 0.0;
  for (int i = -half + 1; i < half; ++i) {
    samples.emplace_back(width * i / half, half - std::abs(i));
    sum += samples.back().second;
  }
  for (auto& sample : samples) sample.second /= sum;
  return samples;
}

}  // namespace

ReliefMap::ReliefMap(int nx, int ny, Eigen::Vector2d first, Eigen::Vector2d spacing, std::array<bool, 2> repeated,
                     std::vector<float> heights)
    : nx_(nx), ny_(ny), first_(first), spacing_(spacing), repeated_(repeated), heights_(std::move(heights)) {
  if (nx < 1 || ny < 1 || nx > kMostPoints / ny)
    fail("a relief of {} x {} heights; allowed is 1 to 67 million", nx, ny);
  if (heights_.size() != static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny)) {
    fail("a relief of {} x {} heights is given {} of them", nx, ny, heights_.size());
  }
  if (!(spacing.minCoeff() > 0.0) || !spacing.allFinite() || !first.allFinite()) {
    fail("the relief's heights stand ({}, {}) mm apart; that must be above 0 and finite", spacing.x(), spacing.y());
  }
  for (const float height : heights_) {
    if (!std::isfinite(height) || height < 0.0F) fail("a height of the relief is {} mm; it must be at least 0", height);
    highest_ = std::max(highest_, static_cast<double>(height));
  }
}

double ReliefMap::at(double x, double y) const {
  const Cell i = cell((x - first_.x()) / spacing_.x(), nx_, repeated_[0]);
  const Cell j = cell((y - first_.y()) / spacing_.y(), ny_, repeated_[1]);
  const auto value = [&](int a, int b) {
    return a < 0 || b < 0 ? 0.0 : static_cast<double>(heights_[static_cast<std::size_t>(b) * nx_ + a]);
  };
  return (1.0 - j.t) * ((1.0 - i.t) * value(i.low, j.low) + i.t * value(i.high, j.low)) +
         j.t * ((1.0 - i.t) * value(i.low, j.high) + i.t * value(i.high, j.high));
}

ReliefMap ReliefMap::blurred(double width) const {
  TS_ASSERT(width > 0.0);
  Eigen::Vector2d first;
  Eigen::Vector2d spacing;
  std::array<int, 2> count{};
  const std::array<int, 2> n = {nx_, ny_};
  for (int axis = 0; axis < 2; ++axis) {
    const double wanted = width / kPointsAWidth;
    if (repeated_[axis]) {
      const double period = n[axis] * spacing_[axis];
      count[axis] = std::max(1, static_cast<int>(std::ceil(period / wanted)));
      spacing[axis] = period / count[axis];
      first[axis] = first_[axis];
    } else {
      const double reach = (n[axis] + 1) * spacing_[axis] + 2.0 * width;
      count[axis] = static_cast<int>(std::ceil(reach / wanted)) + 1;
      spacing[axis] = wanted;
      first[axis] = first_[axis] + 0.5 * (n[axis] - 1) * spacing_[axis] - 0.5 * (count[axis] - 1) * wanted;
    }
  }
  if (count[0] > kMostPoints / count[1]) fail("the relief is too wide for a mesh with edges of {} mm", width);
  // One axis after the other: along x at the old rows' y, then along y.
  const auto along_x = window(width, spacing_.x());
  const auto along_y = window(width, spacing_.y());
  std::vector<float> rows(static_cast<std::size_t>(count[0]) * ny_);
  tbb::parallel_for(0, ny_, [&](int j) {
    for (int i = 0; i < count[0]; ++i) {
      double sum = 0.0;
      for (const auto& [offset, weight] : along_x) {
        sum += weight * at(first.x() + spacing.x() * i + offset, first_.y() + spacing_.y() * j);
      }
      rows[static_cast<std::size_t>(j) * count[0] + i] = static_cast<float>(sum);
    }
  });
  const ReliefMap half(count[0], ny_, {first.x(), first_.y()}, {spacing.x(), spacing_.y()}, repeated_, std::move(rows));
  std::vector<float> heights(static_cast<std::size_t>(count[0]) * count[1]);
  tbb::parallel_for(0, count[1], [&](int j) {
    for (int i = 0; i < count[0]; ++i) {
      double sum = 0.0;
      for (const auto& [offset, weight] : along_y) {
        sum += weight * half.at(first.x() + spacing.x() * i, first.y() + spacing.y() * j + offset);
      }
      heights[static_cast<std::size_t>(j) * count[0] + i] = static_cast<float>(sum);
    }
  });
  return {count[0], count[1], first, spacing, repeated_, std::move(heights)};
}

}  // namespace touchstone::fem
