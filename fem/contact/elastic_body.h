#pragma once
// What an elastic body that touches the gel gives way by itself, seen by the gel's contact vertices.

#include <Eigen/Core>
#include <vector>

#include "core/transform.h"
#include "fem/contact/contact_gap.h"
#include "fem/contact/patch_motion.h"
#include "fem/elements/compliance.h"
#include "fem/mesh/triangle_tree.h"

namespace touchstone::fem {

/// The body's own compliance, ready to be added to the gel's. With the gel's hats phi_i and the body's psi_j, and
/// B_ij = int phi_i psi_j dA over the gel's surface (points are carried over along the gel's normal), equal and
/// opposite tractions on the two surfaces make the body's surface move by B W^-1 H W^-1 B^T seen by the gel's hats: H
/// is the body's compliance, W its hats' weights (a mortar coupling with lumped mass [Wohlmuth2011, sec. 3]). It is
/// symmetric, and forces and torques are handed over whole wherever the gel's hats lie on the body's surface. Where the
/// body's outline cuts a hat, phi_i is what is left of it (`cuts`; null: none is cut).
class ElasticBody {
 public:
  /// `body`: in the object's frame, bonded where the object is held; it must outlive this.
  explicit ElasticBody(const Compliance& body);

  /// Adds `scale` times the body's part for the gel's `vertices` to `compliance` (3 m x 3 m, in the vertices' own
  /// `axes`). `mine` is a flag per entry of `vertices`: those that touch this body.
  void add_to(Eigen::MatrixXd& compliance, double scale, const ContactSurface& surface,
              const std::vector<int>& vertices, const std::vector<char>& mine, const std::vector<Eigen::Matrix3d>& axes,
              const RigidTransform& gel_from_object, const PatchMotion& lookup, const CutHats* cuts) const;
  /// The same for the normal components alone (m x m), of a flat gel whose normal is `normal`: all that contact without
  /// friction asks for, at a ninth of the price.
  void add_normal_to(Eigen::MatrixXd& compliance, double scale, const ContactSurface& surface,
                     const std::vector<int>& vertices, const std::vector<char>& mine, const Eigen::Vector3d& normal,
                     const RigidTransform& gel_from_object, const PatchMotion& lookup, const CutHats* cuts) const;

 private:
  /// B W^-1, its columns over the body's vertices that are met, which it gives in `met`.
  Eigen::SparseMatrix<double> coupling(const ContactSurface& surface, const std::vector<int>& vertices,
                                       const std::vector<char>& mine, const RigidTransform& gel_from_object,
                                       const PatchMotion& lookup, const CutHats* cuts, std::vector<int>& met) const;

  const Compliance& body_;
  TriangleTree outer_;
  Eigen::VectorXd weight_;
};

}  // namespace touchstone::fem
