#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/contact/contact_gap.h"
#include "fem/elements/compliance.h"

namespace touchstone::fem {

/// The few surface vertices that may be in contact, and the compliance among them in each vertex's own axes
/// (-normal, first tangent, second tangent): pressure and tangential traction against closing and tangential
/// displacement. The whole compliance is touched only when the block changes.
class ContactBlock {
 public:
  /// An empty block. The gel must outlive this.
  ContactBlock(const Compliance& gel, const ContactSurface& surface);

  /// Makes the block hold `needed` (vertex indices, rising, unique). An old block that holds them and isn't far too
  /// large is kept as it is; one that grows keeps what it has. True if the block changed.
  bool hold(const std::vector<int>& needed);

  const std::vector<int>& vertices() const { return vertices_; }
  /// Place of a surface vertex in the block, -1 if it isn't in it.
  int place(int vertex) const { return place_[vertex]; }
  /// 3 m x 3 m
  Eigen::Ref<const Eigen::MatrixXd> compliance() const {
    const auto rows = static_cast<Eigen::Index>(3 * vertices_.size());
    return Eigen::Map<const Eigen::MatrixXd>(compliance_.data(), rows, rows);
  }
  /// m x m: its normal rows and columns
  const Eigen::MatrixXd& normal_compliance() const { return normal_compliance_; }
  /// Columns are the vertex's own axes in the gel frame.
  const Eigen::Matrix3d& axes(int vertex) const { return axes_[vertex]; }
  const std::vector<Eigen::Matrix3d>& axes() const { return axes_; }  ///< of all vertices of the surface

 private:
  void make_room(Eigen::Index m);

  const Compliance& gel_;
  std::vector<Eigen::Matrix3d> axes_;
  std::vector<int> vertices_;
  std::vector<int> place_;
  Eigen::VectorXd compliance_;  // 3 m x 3 m, by column, and room for more
  Eigen::MatrixXd normal_compliance_;
};

}  // namespace touchstone::fem
