#pragma once
// The gap between the gel's undeformed outer surface and a rigid body, weighted by the hat functions.

#include <Eigen/Core>
#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "core/transform.h"
#include "fem/contact/cut_hats.h"
#include "fem/contact/patch_motion.h"
#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// What contact asks of the outer surface's geometry, made once.
struct ContactSurface {
  /// The outer surface of a gel that is set up.
  explicit ContactSurface(const Compliance& gel);
  /// `mass` is n x n: int phi_i phi_j dA (P1 hats).
  ContactSurface(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<int, 3>> triangles,
                 const Eigen::SparseMatrix<double>& mass, double thickness);
  /// `mass` is n x n: int phi_i phi_j dA (P1 hats).
  ContactSurface(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<int, 3>> triangles,
                 const Eigen::SparseMatrix<double>& mass);

  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
  std::vector<Eigen::Vector3d> normals;        ///< unit, outward, the triangles' mean weighted by area
  Eigen::VectorXd weight;                      ///< int phi_i dA, mm^2
  std::vector<std::vector<int>> around;        ///< neighbours of each vertex by edges, rising
  std::vector<std::vector<int>> triangles_of;  ///< that have the vertex as a corner, rising
  std::vector<double> triangle_size;           ///< mm, from a triangle's middle to its farthest corner
  std::vector<double> triangle_area;           ///< mm^2
  bool flat = true;                            ///< one normal all over
  /// mm: of a curved gel the line through a surface point leaves it again on its far side; a body that lies wholly more
  /// than this behind the point is there and not in contact here. Half the gel's thickness, infinite for a flat gel.
  double farthest_behind = std::numeric_limits<double>::infinity();
};

/// Covered share of its hat from which a vertex bears. With a half, a sharp punch's contact ended 0.11 edges too far
/// out and was 4 to 6 % too stiff (radius of 5 and 2.5 edges, nu 0.3 to 0.5, against integral equations, mean over
/// places); this leaves 1 % and less.
inline constexpr double kBearingShare = 0.59;
inline constexpr double kBearingFade = 0.1;  ///< share over which a vertex comes to bear
inline constexpr double kLeastShare = 0.25;  ///< covered share below which a vertex is far

/// The weighted gap per surface vertex where there is one.
///
/// gap(x) is the distance from the surface point x, moved by the gel's tangential displacement there, along the outward
/// normal to where the line enters the body; negative where they overlap. `plain[i]` = int phi_i gap dA over the part
/// of the hat's support whose lines hit the body, scaled up from that part to the whole support: beyond the body's
/// silhouette the gap is continued by its mean, and so it is where the body's steep side is seen (a rise of more than
/// twice a triangle's size within it): a punch that is tilted a little bears as one that isn't. Where the covered share
/// c of the support is under 0.59, `weighted[i]` has the depth of the deepest overlap times (0.59 - c) / 0.1 added
/// to the mean: such vertices stay open (a sharp punch's edge then lies, on average over its position in the mesh,
/// where it should) while the answer stays continuous as the body moves. Vertices with c < 0.25 have no gap: they are
/// infinitely far.
struct WeightedGap {
  Eigen::VectorXd weighted;  ///< mm^3; infinity: far
  Eigen::VectorXd plain;     ///< mm^3, without the edge's part
  Eigen::VectorXd edge;      ///< mm^2: how much `weighted` holds of the deepest overlap, 0 where c >= 0.59
  Eigen::VectorXd lowest;    ///< mm, the least gap seen within the hat's support; infinity: far
  double deepest = std::numeric_limits<double>::infinity();  ///< mm, the least gap of all; negative: overlap
  double reach = std::numeric_limits<double>::infinity();  ///< mm: vertices that come nearer than this aren't left out
  std::shared_ptr<const CutHats> cuts;                     ///< none: no outline crosses the surface
  /// mm: the least and the largest gap in each triangle over which the gap is bent, as under a tip or a ridge.
  std::vector<std::array<double, 2>> bent;

  /// The gap after the body has moved by `distance` (mm) along the normal of a flat surface, exactly; `weight` is the
  /// surface's.
  void move_along_normals(const Eigen::VectorXd& weight, double distance);

  /// Whether after such a motion hats are to be cut by the border of the overlap, or were before it.
  bool overlap_cuts_after(double distance) const;
};

/// Which vertices are asked for: those whose gap is under max(least gap, 0) + `margin` + `of_depth` * depth. Others may
/// come out as far. Only convex bodies make use of it.
struct GapReach {
  double margin = std::numeric_limits<double>::infinity();  ///< mm
  double of_depth = 0.0;
};

/// Integrates by the 7-point rule of degree 5; triangles that the silhouette crosses, or that are large beside the
/// body, are split, and the cells on the silhouette clipped at it. The gel is looked up where `lookup` has moved it
/// along itself. With `cut`, hats are cut by the body's outline (see cut_hats.h), or are taken as `kept` has them if
/// that is given: the body has moved but a little since. And triangles of a curved gel bulge as their normals say;
/// without it they are flat, as at finite strain.
WeightedGap weighted_gap(const ContactSurface& surface, const ContactShape& shape,
                         const RigidTransform& gel_from_object, const PatchMotion& lookup = {}, GapReach reach = {},
                         bool cut = false, std::shared_ptr<const CutHats> kept = nullptr);

/// `deepest` of weighted_gap() at the gel's rest, mm, in about half of its time.
double deepest_gap(const ContactSurface& surface, const ContactShape& shape, const RigidTransform& gel_from_object,
                   bool cut = false);

}  // namespace touchstone::fem
