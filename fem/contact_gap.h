#pragma once
// The gap between the gel's undeformed outer surface and a rigid body, weighted by the hat functions.

#include <Eigen/Core>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "core/transform.h"
#include "fem/compliance.h"
#include "fem/contact_shape.h"

namespace touchstone::fem {

/// What contact asks of the outer surface's geometry, made once.
struct ContactSurface {
  explicit ContactSurface(const Compliance& gel);
  /// `mass` is n x n: int phi_i phi_j dA (P1 hats).
  ContactSurface(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<int, 3>> triangles,
                 const Eigen::SparseMatrix<double>& mass);

  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
  std::vector<Eigen::Vector3d> normals;  ///< unit, outward, the triangles' mean weighted by area
  Eigen::VectorXd weight;                ///< int phi_i dA, mm^2
  std::vector<std::vector<int>> around;  ///< neighbours of each vertex by edges, rising
};

/// The weighted gap per surface vertex where there is one.
///
/// gap(x) is the distance from the surface point x, moved by the gel's tangential displacement there, along the outward
/// normal to where the line enters the body; negative where they overlap. `weighted[i]` = int phi_i gap dA over the
/// part of the hat's support whose lines hit the body, scaled up from that part to the whole support: beyond the body's
/// silhouette the gap is continued by its mean. Where the covered share c of the support is under one half, the depth
/// of the deepest overlap times (0.5 - c) / 0.1 is added to the mean: such vertices stay open (a sharp punch's edge
/// then lies, on average over its position in the mesh, where it should) while the answer stays continuous as the body
/// moves. Vertices with c < 0.25 have no gap: they are infinitely far.
struct WeightedGap {
  Eigen::VectorXd weighted;  ///< mm^3; infinity: far
  Eigen::VectorXd edge;      ///< mm^2: how much `weighted` holds of the deepest overlap, 0 where c >= 0.5
  Eigen::VectorXd lowest;    ///< mm, the least gap seen within the hat's support; infinity: far
  double deepest = std::numeric_limits<double>::infinity();  ///< mm, the least gap of all; negative: overlap
};

/// Integrates by the 7-point rule of degree 5; triangles that the silhouette crosses, or that are large beside the
/// body, are split, and the cells on the silhouette clipped at it. `tangential` is the gel's displacement per vertex
/// (mm, its normal part is ignored); it may be empty. `wanted` (a flag per vertex; empty: all) restricts the work:
/// unwanted vertices come out as far, and `deepest` is over the wanted ones' supports.
WeightedGap weighted_gap(const ContactSurface& surface, const ContactShape& shape,
                         const RigidTransform& gel_from_object, std::span<const Eigen::Vector3d> tangential,
                         std::span<const char> wanted = {});

}  // namespace touchstone::fem
