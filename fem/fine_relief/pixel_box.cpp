#include "fem/fine_relief/pixel_box.h"

#include <algorithm>
#include <cmath>

namespace touchstone::fem {
namespace {

constexpr int kBorder = 4;  // pixels: contact nearer to the grid's border than this widens it

}  // namespace

PixelBox box_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double pitch) {
  const auto pixel = [&](double x) { return static_cast<int>(std::floor(std::clamp(x / pitch, -1e8, 1e8))); };
  return {pixel(low.x()), pixel(low.y()), pixel(high.x()), pixel(high.y())};
}

PixelBox common(const PixelBox& a, const PixelBox& b) {
  return {std::max(a.left, b.left), std::max(a.bottom, b.bottom), std::min(a.right, b.right), std::min(a.top, b.top)};
}

PixelBox of_kept_size(const PixelBox& box, const PixelBox& whole) {
  const auto widen = [](int& low, int& high, int least, int most) {
    int size = 24;
    while (size < high - low + 1) size += (size + 5) / 6;
    size = std::min(size, most - least + 1);
    low = std::max(least, low - (size - (high - low + 1)) / 2);
    high = std::min(most, low + size - 1);
    low = high - size + 1;
  };
  PixelBox wide = box;
  widen(wide.left, wide.right, whole.left, whole.right);
  widen(wide.bottom, wide.top, whole.bottom, whole.top);
  return wide;
}

PixelBox widened(const PixelBox& box, const PixelGrid& grid, const std::vector<double>& pressure) {
  PixelBox wider = box;
  const auto pressed = [&](int i, int j) { return pressure[grid.at(i, j)] > 0.0; };
  const int step_x = std::max(16, grid.nx / 4);
  const int step_y = std::max(16, grid.ny / 4);
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < std::min(kBorder, grid.nx); ++i) {
      if (pressed(i, j)) wider.left = box.left - step_x;
      if (pressed(grid.nx - 1 - i, j)) wider.right = box.right + step_x;
    }
  }
  for (int i = 0; i < grid.nx; ++i) {
    for (int j = 0; j < std::min(kBorder, grid.ny); ++j) {
      if (pressed(i, j)) wider.bottom = box.bottom - step_y;
      if (pressed(i, grid.ny - 1 - j)) wider.top = box.top + step_y;
    }
  }
  return wider;
}

std::vector<double> on_grid(const PixelGrid& from, const std::vector<double>& values, const PixelGrid& to,
                            double elsewhere) {
  const Eigen::Vector2d offset = (to.first - from.first) / to.pitch;
  const auto di = static_cast<int>(std::lround(offset.x()));
  const auto dj = static_cast<int>(std::lround(offset.y()));
  std::vector<double> result(to.size(), elsewhere);
  for (int j = 0; j < to.ny; ++j) {
    for (int i = 0; i < to.nx; ++i) {
      if (i + di < 0 || i + di >= from.nx || j + dj < 0 || j + dj >= from.ny) continue;
      result[to.at(i, j)] = values[from.at(i + di, j + dj)];
    }
  }
  return result;
}

}  // namespace touchstone::fem
