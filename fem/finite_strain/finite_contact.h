#pragma once
// The gap between the gel's deformed surface and a rigid body, and how it changes as the surface moves.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "core/transform.h"
#include "fem/elements/surface_coupling.h"
#include "fem/elements/taylor_hood.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// The lines along which gaps are looked up: points of the undeformed surface whose lines hit the body, and directions.
struct GapLines {
  /// A point of integration within a triangle of the surface.
  struct Point {
    Eigen::Vector3d barycentric;
    double weight = 0.0;  ///< mm^2, of undeformed surface
  };
  std::vector<std::vector<Point>> points;  ///< per triangle
  std::vector<Eigen::Vector3d> normals;    ///< per vertex; in between they are interpolated
  double deepest = 0.0;                    ///< mm: a line that enters the body further back than this is a miss
};

/// The lines of a deformed surface. `overlap` (mm, >= 0) is how deep the body reaches under the undeformed surface.
GapLines gap_lines(const TaylorHoodSpace& space, const OuterSurface& surface, const Eigen::MatrixX3d& displacement,
                   const ContactShape& shape, const RigidTransform& gel_from_object, double overlap);

/// What holds the middle of an edge in contact between its ends. The hats' mean gaps leave the quadratic part of the
/// surface free, and under a pressure of some 2 G those modes buckle (in the continuum, contact holds them): so each
/// edge resists bulging against the body with a stiffness in proportion to the pressure on it. Where contact is close
/// it has nothing to resist, and for small loads it vanishes beside the gel's own stiffness.
struct EdgeBulge {
  std::array<int, 3> nodes{};  ///< middle, then the two ends
  int body = 0;                ///< against which it bulges
  double value = 0.0;          ///< mm: gap in the middle less the ends' mean
  double stiffness = 0.0;      ///< N/mm
  std::array<Eigen::Vector3d, 3> gradient;
};

/// The gap of each surface vertex at a deformed state.
///
/// gap(x) is the distance from the deformed surface point x (the quadratic displacement itself, not its projection)
/// along its line to where that enters the body. `weighted[i]` = int phi_i gap dA over the undeformed hat's hit part,
/// scaled up to the whole hat, as in weighted_gap, which it becomes at rest. `gradient` is its derivative by the
/// displacement at held lines, exactly (as the gap closes, how the lines turn stops mattering): the vertex's pressure
/// p_i pushes the gel by p_i times it. So contact forces act along the body's normals and derive from a potential:
/// without friction the force on the body is the derivative of the stored energy.
struct DeformedGap {
  Eigen::VectorXd weighted;  ///< n, mm^3; infinity: far
  /// n x (3 nodes), mm^2: row i holds d weighted_i / d u_node, 3 * node + component
  Eigen::SparseMatrix<double, Eigen::RowMajor> gradient;
  Eigen::MatrixX3d direction;  ///< n x 3, mm^2: the gradient's sum over nodes, d weighted_i / d (shift of the gel)
  /// Of each body, (3 nodes) x (3 nodes), MPa mm: the sum of pressure_i d^2 weighted_i / du^2, by the body's curvature
  /// under the lines.
  std::vector<Eigen::SparseMatrix<double>> curvature;
  std::vector<EdgeBulge> bulges;
  double deepest = std::numeric_limits<double>::infinity();  ///< mm, the least gap of all; negative: overlap
};

/// `weight` is int phi_i dA. Vertices that the body covers by less than half of their hats stay open: their gap is
/// raised by up to `overlap` (as in gap_lines), as in weighted_gap. `pressure` (n, MPa) is for `bulges` and
/// `curvature`; the latter is meant for Newton's method: second differences, of no more curvature than the mesh can
/// follow.
DeformedGap deformed_gap(const TaylorHoodSpace& space, const OuterSurface& surface, const Eigen::VectorXd& weight,
                         const GapLines& lines, const Eigen::MatrixX3d& displacement, const ContactShape& shape,
                         const RigidTransform& gel_from_object, double overlap, const Eigen::VectorXd& pressure);

/// Of several bodies' gaps each vertex's from the body that `owner` names; -1: none, its gap is infinite.
DeformedGap merged_gap(std::vector<DeformedGap> gaps, const std::vector<int>& owner);

}  // namespace touchstone::fem
