#include "render/cameras/edge_rays.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/error.h"

namespace touchstone::render {
namespace {

struct GridRay {
  bool valid;
  Eigen::Vector3f origin, direction;
  float far;
};
GridRay grid_ray(const CameraRays& rays, int row, int column) {
  const RayPacket& packet = rays.packets[row / CameraRays::kSide * rays.tiles_across + column / CameraRays::kSide];
  const int lane = row % CameraRays::kSide * CameraRays::kSide + column % CameraRays::kSide;
  return {packet.valid[lane] != 0,
          {packet.origin[0][lane], packet.origin[1][lane], packet.origin[2][lane]},
          {packet.direction[0][lane], packet.direction[1][lane], packet.direction[2][lane]},
          packet.far[lane]};
}

}  // namespace

std::vector<int> edge_points(std::span<const float> radiance, const ImageGrid& grid, int bands, double contrast) {
  const int columns = grid.columns;
  const int rows = grid.rows;
  const std::size_t points = static_cast<std::size_t>(columns) * rows;
  TS_ASSERT(radiance.size() == points * bands);
  std::vector<double> squares(rows);
  tbb::parallel_for(0, rows, [&](int row) {
    for (int band = 0; band < bands; ++band) {
      const float* at = radiance.data() + band * points + static_cast<std::size_t>(row) * columns;
      for (int k = 0; k < columns; ++k) squares[row] += double(at[k]) * double(at[k]);
    }
  });
  double square = 0.0;
  for (double one : squares) square += one;
  const auto limit = static_cast<float>(contrast * contrast * square / double(points));
  const auto differ = [&](std::size_t one, std::size_t other) {
    float sum = 0.0f;
    for (int band = 0; band < bands; ++band) {
      const float difference = radiance[band * points + one] - radiance[band * points + other];
      sum += difference * difference;
    }
    return sum > limit;
  };
  std::vector<std::vector<int>> by_row(rows);
  tbb::parallel_for(0, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      const std::size_t point = static_cast<std::size_t>(row) * columns + column;
      if ((column > 0 && differ(point, point - 1)) || (column + 1 < columns && differ(point, point + 1)) ||
          (row > 0 && differ(point, point - columns)) || (row + 1 < rows && differ(point, point + columns))) {
        by_row[row].push_back(static_cast<int>(point));
      }
    }
  });
  std::vector<int> all;
  for (const auto& one : by_row) all.insert(all.end(), one.begin(), one.end());
  return all;
}

void put_edge_rays(const CameraRays& rays, int point, int side, RayPacket& packet, int first_lane) {
  const int column = point % rays.grid.columns;
  const int row = point / rays.grid.columns;
  const GridRay here = grid_ray(rays, row, column);
  const auto slope = [&](int rows_on, int columns_on) {
    Eigen::Matrix<float, 3, 2> change = Eigen::Matrix<float, 3, 2>::Zero();
    const int row_to = std::min(row + rows_on, rays.grid.rows - 1);
    const int column_to = std::min(column + columns_on, rays.grid.columns - 1);
    const int row_from = std::max(row - rows_on, 0);
    const int column_from = std::max(column - columns_on, 0);
    const GridRay to = grid_ray(rays, row_to, column_to);
    const GridRay from = grid_ray(rays, row_from, column_from);
    const int steps = row_to - row_from + column_to - column_from;
    if (to.valid && from.valid && steps > 0) {
      change << (to.origin - from.origin) / static_cast<float>(steps),
          (to.direction - from.direction) / static_cast<float>(steps);
    }
    return change;
  };
  const Eigen::Matrix<float, 3, 2> across = slope(0, 1);
  const Eigen::Matrix<float, 3, 2> down = slope(1, 0);
  // A grid whose rows are set off against each other, and its columns, so that no two points share an x or a y
  // ([Chiu1994] without the jitter): an edge that runs with the pixels has as many places between them to be found at
  // as there are points. Moved from pixel to pixel by less than that, in steps of the golden section, so that along
  // such an edge the mean is right too.
  constexpr double kGolden = 0.6180339887498949;
  const auto moved = [](int by) {
    const double turns = kGolden * (by + 0.5);
    return static_cast<float>(turns - std::floor(turns));
  };
  const float x_moved = moved(row);
  const float y_moved = moved(column);
  const auto sides = static_cast<float>(side);
  for (int k = 0; k < side * side; ++k) {
    const auto i = static_cast<float>(k % side);
    const auto j = static_cast<float>(k / side);
    const float x = (i + (j + x_moved) / sides) / sides - 0.5f;
    const float y = (j + (i + y_moved) / sides) / sides - 0.5f;
    const Eigen::Vector3f origin = here.origin + x * across.col(0) + y * down.col(0);
    const Eigen::Vector3f direction = (here.direction + x * across.col(1) + y * down.col(1)).normalized();
    const int lane = first_lane + k;
    for (int a = 0; a < 3; ++a) {
      packet.origin[a][lane] = origin[a];
      packet.direction[a][lane] = direction[a];
    }
    packet.far[lane] = here.far;
    packet.valid[lane] = here.valid ? -1 : 0;
  }
}

}  // namespace touchstone::render
