#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/compliance.h"
#include "fem/contact_gap.h"

namespace touchstone::fem {

/// The few surface vertices that may be in contact, and the compliance among them in each vertex's own axes
/// (-normal, first tangent, second tangent): pressure and tangential traction against closing and tangential
/// displacement. The whole compliance is touched only when the block changes.
class ContactBlock {
 public:
  /// `components`: 1 keeps the normal axis only, 3 keeps all.
  ContactBlock(const Compliance& gel, const ContactSurface& surface, int components);

  /// Makes the block hold `needed` (vertex indices, rising, unique). An old block that holds them and isn't far too
  /// large is kept as it is.
  void hold(const std::vector<int>& needed);

  const std::vector<int>& vertices() const { return vertices_; }
  /// Place of a surface vertex in the block, -1 if it isn't in it.
  int place(int vertex) const { return place_[vertex]; }
  const Eigen::MatrixXd& compliance() const { return compliance_; }
  int components() const { return components_; }
  /// Columns are the vertex's own axes in the gel frame.
  const Eigen::Matrix3d& axes(int vertex) const { return axes_[vertex]; }

 private:
  const Compliance& gel_;
  int components_;
  std::vector<Eigen::Matrix3d> axes_;
  std::vector<int> vertices_;
  std::vector<int> place_;
  Eigen::MatrixXd compliance_;
};

}  // namespace touchstone::fem
