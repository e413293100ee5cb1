#pragma once
// The gel's outer surface as the camera sees it: finer and smoother than the mesh that carries the forces, and true to
// the body that presses on it.

#include <Eigen/SparseCore>
#include <array>
#include <span>
#include <vector>

#include "core/triangle_mesh.h"
#include "fem/contact/press.h"
#include "fem/elements/compliance.h"
#include "fem/mesh/gel_body.h"
#include "fem/shapes/contact_shape.h"
#include "sim/scene/contact_pressure.h"

namespace touchstone::sim {

/// A body where it stands.
struct PlacedShape {
  const fem::ContactShape& shape;
  RigidTransform gel_from_object;
};

/// The whole of a gel's outer surface as it's seen, with what its points were before. Gel frame, mm.
struct GelSheet {
  TriangleMesh mesh;
  std::vector<int> touched;           ///< per triangle: the body that it lies on, -1 where it's free
  std::vector<Eigen::Vector3d> rest;  ///< per vertex: the same material point on the undeformed gel
};

/// The elements' edges (half a millimetre) are wide against what a camera resolves, and the displacement that mechanics
/// gives per vertex overshoots beside a sharp rim (it's a projection on hat functions; here its means over the hats are
/// taken). Seen through the gel both would
/// show: as a many-cornered edge of contact with glints on it. So the surface is subdivided twice ([Loop1987]; the
/// pad's edge by straight halving) from vertices that lie on the body where they're in contact, and where the fine
/// surface reaches into the body it's laid onto it: straight along z, of a fingertip along its undeformed surface's
/// normal unless that leads past the body's face (over a millimetre away, and further than straight along z). The
/// undeformed surface of domes and fingertips is subdivided on its true sphere and cylinder, to rounding. Made once a
/// gel; safe to use from many threads.
class VisibleGel {
 public:
  /// `body` is that of the compliance; a flat one's outer surface is as its mesh has it.
  explicit VisibleGel(const fem::Compliance& gel, const fem::GelBody& body = fem::SlabGel{});

  /// The displaced surface. The bodies are those of the press, in their order.
  GelSheet sheet(const fem::PressState& press, std::span<const PlacedShape> bodies) const;
  /// The displaced surface without what the body wets: triangles all of whose corners lie on it. Gel frame, mm.
  /// The bodies are those of the press, in their order.
  TriangleMesh dry_surface(const fem::PressState& press, std::span<const PlacedShape> bodies) const;
  /// The same for a press with one body.
  TriangleMesh dry_surface(const fem::PressState& press, const fem::ContactShape& shape) const;
  /// Normal pressure that the gel of a press exerts on its `body`-th body, on the mechanics' own vertices.
  /// @pre the gel is a slab
  ContactPressure pressure_on(const fem::PressState& press, int body) const;

 private:
  Eigen::MatrixX3d rest_;          // of the mechanics' vertices
  Eigen::MatrixX3d fine_rest_;     // of the visible ones
  Eigen::MatrixX3d up_, fine_up_;  // unit: directions out of the gel along which it is laid onto bodies
  Eigen::SparseMatrix<double, Eigen::RowMajor> averaged_;  // hat-weighted means from values at the vertices
  Eigen::SparseMatrix<double, Eigen::RowMajor> fine_from_coarse_;
  std::vector<std::array<int, 3>> coarse_, fine_;  // triangles; those of coarse triangle i begin at fine_[i * kParts]
};

}  // namespace touchstone::sim
