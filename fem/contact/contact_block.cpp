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

/// Space for m vertices, with what is there kept. A block grows some times in a press; more than is needed is asked
/// for, since memory that is new costs as much as what is written to it.
void ContactBlock::make_room(Eigen::Index m) {
  constexpr double kMore = 2.5;  // memory that nothing was written to costs nothing
  const Eigen::Index needed = 9 * m * m;
  if (needed <= compliance_.size()) return;
  Eigen::VectorXd wider(static_cast<Eigen::Index>(kMore * static_cast<double>(needed)));
  const auto kept = static_cast<Eigen::Index>(9 * vertices_.size() * vertices_.size());
  wider.head(kept) = compliance_.head(kept);
  compliance_.swap(wider);
}

bool ContactBlock::hold(const std::vector<int>& needed) {
  const bool held = std::all_of(needed.begin(), needed.end(), [&](int v) { return place_[v] >= 0; });
  if (held && vertices_.size() <= 2 * needed.size() + 30) return false;
  const auto m = static_cast<Eigen::Index>(needed.size());
  make_room(m);
  // By vertex of the new block its place in the old one, -1 where it's new. Blocks are sorted, so where the new one
  // holds all of the old, what stays moves to higher addresses: from the end on nothing is overwritten before it has
  // moved.
  std::vector<Eigen::Index> before;
  before.reserve(needed.size());
  for (const int v : needed) before.push_back(place_[v]);
  const auto rows_before = static_cast<Eigen::Index>(3 * vertices_.size());
  const bool all_stay =
      std::count_if(before.begin(), before.end(), [](Eigen::Index k) { return k >= 0; }) * 3 == rows_before;
  if (!all_stay) std::fill(before.begin(), before.end(), -1);
  for (const int v : vertices_) place_[v] = -1;
  vertices_ = needed;
  double* const all = compliance_.data();
  for (Eigen::Index j = m - 1; j >= 0; --j) {
    const int vj = vertices_[j];
    place_[vj] = static_cast<int>(j);
    for (Eigen::Index column = 2; column >= 0 && before[j] >= 0; --column) {
      double* const to = all + (3 * j + column) * 3 * m;
      const double* const from = all + (3 * before[j] + column) * rows_before;
      for (Eigen::Index i = m - 1; i >= 0; --i) {
        if (before[i] < 0) continue;
        for (Eigen::Index row = 2; row >= 0; --row) to[3 * i + row] = from[3 * before[i] + row];
      }
    }
  }
  Eigen::Map<Eigen::MatrixXd> compliance(all, 3 * m, 3 * m);
  const auto fill = [&](const auto& own) {
    for (Eigen::Index j = 0; j < m; ++j) {
      for (Eigen::Index i = 0; i < m; ++i) {
        if (before[i] >= 0 && before[j] >= 0) continue;
        compliance.block<3, 3>(3 * i, 3 * j).noalias() =
            axes_[vertices_[i]].transpose() * (own(i, j) * axes_[vertices_[j]]);
      }
    }
  };
  if (const SharedMatrix* const whole = gel_.surface.whole()) {
    const SharedMatrix::View view = whole->view();
    fill([&](Eigen::Index i, Eigen::Index j) { return view.block<3, 3>(3 * vertices_[i], 3 * vertices_[j]); });
  } else {
    std::vector<int> added;
    std::vector<Eigen::Index> column(needed.size(), -1);
    for (Eigen::Index j = 0; j < m; ++j) {
      if (before[j] >= 0) continue;
      column[j] = std::ssize(added);
      added.push_back(vertices_[j]);
    }
    const Eigen::MatrixXd block = gel_.surface.block(needed, added);
    fill([&](Eigen::Index i, Eigen::Index j) -> Eigen::Matrix3d {
      if (column[j] >= 0) return block.block<3, 3>(3 * i, 3 * column[j]);
      return block.block<3, 3>(3 * j, 3 * column[i]).transpose();
    });
  }
  const auto normals = Eigen::seqN(Eigen::fix<0>, m, Eigen::fix<3>);
  normal_compliance_ = compliance(normals, normals);
  return true;
}

}  // namespace touchstone::fem
