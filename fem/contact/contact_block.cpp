#include "fem/contact/contact_block.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace touchstone::fem {

ContactBlock::ContactBlock(const Compliance& gel, const ContactSurface& surface)
    : gel_(gel), place_(surface.vertices.size(), -1) {
  for (const Eigen::Vector3d& n : surface.normals) {
    // The gel frame's x, seen along the surface; y where x is the normal.
    const Eigen::Vector3d guide = std::abs(n.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    const Eigen::Vector3d first = (guide - guide.dot(n) * n).normalized();
    Eigen::Matrix3d axes;
    axes << -n, first, n.cross(first);
    axes_.push_back(axes);
  }
}

bool ContactBlock::hold(const std::vector<int>& needed) {
  const bool held = std::all_of(needed.begin(), needed.end(), [&](int v) { return place_[v] >= 0; });
  if (held && vertices_.size() <= 2 * needed.size() + 30) return false;
  for (const int v : vertices_) place_[v] = -1;
  vertices_ = needed;
  const auto m = static_cast<Eigen::Index>(vertices_.size());
  compliance_.resize(3 * m, 3 * m);
  const SharedMatrix::View surface_compliance = gel_.surface.view();
  for (Eigen::Index j = 0; j < m; ++j) {
    const int vj = vertices_[j];
    place_[vj] = static_cast<int>(j);
    for (Eigen::Index i = 0; i < m; ++i) {
      const int vi = vertices_[i];
      compliance_.block<3, 3>(3 * i, 3 * j).noalias() =
          axes_[vi].transpose() * (surface_compliance.block<3, 3>(3 * vi, 3 * vj) * axes_[vj]);
    }
  }
  const auto normals = Eigen::seqN(Eigen::fix<0>, m, Eigen::fix<3>);
  normal_compliance_ = compliance_(normals, normals);
  return true;
}

}  // namespace touchstone::fem
