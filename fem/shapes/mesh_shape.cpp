#include "fem/shapes/mesh_shape.h"

#include <utility>

#include "core/error.h"

namespace touchstone::fem {

MeshShape::MeshShape(TriangleMesh mesh) : mesh_(std::move(mesh)), tree_({}, {}) {
  const std::string fault = fault_of_closed_mesh(mesh_);
  if (!fault.empty()) fail("this mesh can't touch a gel: {}", fault);
  tree_ = TriangleTree(mesh_.vertices, mesh_.triangles);
}

std::optional<double> MeshShape::first_entry(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const {
  const auto hit = tree_.first_crossing(point, direction);
  if (!hit) return std::nullopt;
  return hit->along;
}

}  // namespace touchstone::fem
