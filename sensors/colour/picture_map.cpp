#include "sensors/colour/picture_map.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// Moves points to their middle and scales them to a mean square distance of 2 from it.
Eigen::Matrix3d normalising(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points) middle += point / static_cast<double>(points.size());
  double square = 0.0;
  for (const Eigen::Vector2d& point : points)
    square += (point - middle).squaredNorm() / static_cast<double>(points.size());
  const double scale = std::sqrt(2.0 / std::max(square, 1e-300));
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  matrix.topLeftCorner<2, 2>() *= scale;
  matrix.topRightCorner<2, 1>() = -scale * middle;
  return matrix;
}

}  // namespace

PictureMap fit_picture_map(const std::vector<Eigen::Vector2d>& px, const std::vector<Eigen::Vector2d>& mm) {
  TS_ASSERT(px.size() == mm.size());
  if (px.size() < 4) fail("picture map: {} places are known, 4 are needed", px.size());
  const Eigen::Matrix3d from = normalising(px), to = normalising(mm);
  // Each pair p, q gives two rows of A h = 0, of what is linear in h in q x (H p) = 0. The 9 x 9 normal matrix has the
  // same null vector as A.
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < px.size(); ++i) {
    const Eigen::Vector3d p = from * px[i].homogeneous();
    const Eigen::Vector2d q = (to * mm[i].homogeneous()).head<2>();
    for (int axis = 0; axis < 2; ++axis) {
      Eigen::Matrix<double, 9, 1> row = Eigen::Matrix<double, 9, 1>::Zero();
      row.segment<3>(3 * axis) = p;
      row.tail<3>() = -q[axis] * p;
      normal += row * row.transpose();
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>> svd(normal, Eigen::ComputeFullV);
  const auto& sizes = svd.singularValues();
  if (!(sizes[7] > 1e-10 * sizes[0])) fail("picture map: the {} known places lie on a line", px.size());
  const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
  Eigen::Matrix3d matrix;
  matrix << h.head<3>().transpose(), h.segment<3>(3).transpose(), h.tail<3>().transpose();
  PictureMap map;
  map.mm_from_px = to.inverse() * matrix * from;
  map.mm_from_px /= map.mm_from_px(2, 2);
  return map;
}

std::vector<Eigen::Vector2d> grid_places(const Eigen::Vector2i& grid, double spacing_mm) {
  std::vector<Eigen::Vector2d> places;
  for (int row = 0; row < grid.y(); ++row) {
    for (int column = 0; column < grid.x(); ++column) {
      places.emplace_back(spacing_mm * (column - 0.5 * (grid.x() - 1)), spacing_mm * (row - 0.5 * (grid.y() - 1)));
    }
  }
  return places;
}

PictureMap map_of_rest(const ColourMarkerReading& rest, double spacing_mm) {
  if (!(spacing_mm > 0.0) || !std::isfinite(spacing_mm)) {
    fail("picture map: the markers' spacing is {} mm, it must be above 0", spacing_mm);
  }
  const std::vector<Eigen::Vector2d> places = grid_places(rest.grid, spacing_mm);
  TS_ASSERT(places.size() == rest.markers.size());
  std::vector<Eigen::Vector2d> px, mm;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (rest.markers[i].flaw != MarkerFlaw::kNone) continue;
    px.push_back(rest.markers[i].ink_centroid_px);
    mm.push_back(places[i]);
  }
  return fit_picture_map(px, mm);
}

}  // namespace touchstone::sensors
