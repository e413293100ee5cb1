#include "fem/contact_block.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace touchstone::fem {

ContactBlock::ContactBlock(const Compliance& gel, const ContactSurface& surface, int components)
    : gel_(gel), components_(components), place_(surface.vertices.size(), -1) {
  for (const Eigen::Vector3d& n : surface.normals) {
    // The gel frame's x, seen along the surface; y where x is the normal.
    const Eigen::Vector3d guide = std::abs(n.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    const Eigen::Vector3d first = (guide - guide.dot(n) * n).normalized();
    Eigen::Matrix3d axes;
    axes << -n, first, n.cross(first);
    axes_.push_back(axes);
  }
}

void ContactBlock::hold(const std::vector<int>& needed) {
  const bool held = std::all_of(needed.begin(), needed.end(), [&](int v) { return place_[v] >= 0; });
  if (held && vertices_.size() <= 2 * needed.size() + 30) return;
  for (const int v : vertices_) place_[v] = -1;
  vertices_ = needed;
  const int c = components_;
  const auto m = static_cast<Eigen::Index>(vertices_.size());
  compliance_.resize(c * m, c * m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const int vj = vertices_[j];
    place_[vj] = static_cast<int>(j);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> turn = axes_[vj].leftCols(c);
    for (Eigen::Index i = 0; i < m; ++i) {
      const int vi = vertices_[i];
      compliance_.block(c * i, c * j, c, c).noalias() =
          axes_[vi].leftCols(c).transpose() * (gel_.surface.block<3, 3>(3 * vi, 3 * vj) * turn);
    }
  }
}

}  // namespace touchstone::fem
