#pragma once
// A mesh for lines of one direction, as they come from a flat gel.

#include <Eigen/Core>
#include <optional>

#include "fem/mesh/line_grid.h"
#include "fem/shapes/mesh_shape.h"

namespace touchstone::fem {

/// Finds what the mesh itself finds. When so many lines of the direction have been asked for that it pays, they are
/// looked up in a grid. For one thread.
class MeshLines {
 public:
  /// Keeps the reference.
  MeshLines(const MeshShape& shape, const Eigen::Vector3d& direction) : shape_(shape), direction_(direction) {}

  std::optional<double> first_entry(const Eigen::Vector3d& point,
                                    const Eigen::Vector3d& direction) const {  ///< its own
    return use_grid(direction) ? grid_->first_entry(point) : shape_.first_entry(point, direction);
  }
  bool is_hit(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const {  ///< as is_hit of the shape
    return use_grid(direction) ? grid_->is_hit(point) : shape_.is_hit(point, direction);
  }

 private:
  static constexpr std::size_t kTrianglesALine = 4;  // a grid is made in the time of so many

  bool use_grid(const Eigen::Vector3d& direction) const {
    if (direction != direction_) return false;
    if (!grid_ && ++asked_ * kTrianglesALine > shape_.mesh().triangles.size()) {
      grid_.emplace(shape_.mesh().vertices, shape_.mesh().triangles, direction_);
    }
    return grid_.has_value();
  }

  const MeshShape& shape_;
  Eigen::Vector3d direction_;
  mutable std::size_t asked_ = 0;
  mutable std::optional<LineGrid> grid_;  // what is found doesn't depend on it
};
/// As of the mesh's shape.
inline std::optional<double> first_entry(const MeshLines& lines, const Eigen::Vector3d& point,
                                         const Eigen::Vector3d& direction) {
  return lines.first_entry(point, direction);
}
inline bool is_hit(const MeshLines& lines, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& direction) {  ///< likewise
  return lines.is_hit(point, direction);
}
/// Not known for meshes.
inline std::optional<double> silhouette_distance(const MeshLines&, const Eigen::Vector3d&, const Eigen::Vector3d&) {
  return std::nullopt;
}

}  // namespace touchstone::fem
