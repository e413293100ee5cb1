#pragma once
// Hat functions that a body's outline cuts: traction bears only where the body is.
//
// A vertex's traction acts on the part of its hat's support that the body covers, and rises towards a sharp edge as
// pressure does there: as one over the root of the distance [Johnson1985, sec. 5.5]. Hats can't say either, which was
// most of the error of bodies of a few edges. Each cut hat becomes a density on cells of a quarter of an edge. A step
// in the body is an outline, too: of the two sides within one hat the lower one bears.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

namespace touchstone::fem {

struct ContactSurface;

/// A part of a surface triangle that a body covers, itself a triangle.
struct CoveredPiece {
  Eigen::Matrix3d corners;                             ///< barycentric, one a column
  double value = 0.0;                                  ///< mm, mean gap
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();  ///< mm, mean of the gap times each hat
  double overlap = 1.0;                                ///< share of it where the gap is negative
  double within = 0.0;                                 ///< mm, mean gap over that share
  double low = 0.0;                                    ///< mm, least gap seen in it
  double high = 0.0;                                   ///< mm, largest
};

/// A point of a step in the body.
struct StepPoint {
  Eigen::Vector3d at;  ///< barycentric
  double value = 0.0;  ///< mm, halfway between the gaps on both sides
};

/// A surface triangle that a body's outline crosses, or a step in the body, or the border of the overlap under a tip or
/// a ridge that is narrower than the triangle.
struct CrossedTriangle {
  int triangle = 0;
  std::vector<CoveredPiece> pieces;
  std::vector<std::array<Eigen::Vector3d, 2>> outline;  ///< barycentric ends of its stretches in the triangle
  std::vector<StepPoint> steps;                         ///< where steps were found; empty: none
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();  ///< mm: the gap's trend beside steps, a linear one's corner values
  /// How far the gap is from plane over the triangle, of its range, where it changes its sign; 0: it doesn't.
  double bend = 0.0;
};

/// A point that stands for a part of a triangle.
struct DensityCell {
  Eigen::Vector3d corners = Eigen::Vector3d::Zero();  ///< barycentric
  double gap = 0.0;                                   ///< mm, there, as it was when hats were cut
  Eigen::Vector3d at = Eigen::Vector3d::Zero();       ///< mm, gel frame
  double area = 0.0;                                  ///< mm^2
  Eigen::Vector3d density = Eigen::Vector3d::Zero();  ///< mm^2: its part of each corner's integral
};

/// A triangle with a corner whose hat is cut.
struct CutTriangle {
  int triangle = 0;
  std::vector<DensityCell> cells;
};

/// What outlines do to the hats of a surface. A density integrates to its vertex's weight (int phi dA), cut or not.
struct CutHats {
  std::vector<CutTriangle> triangles;  ///< by their index, rising
  std::vector<int> vertices;           ///< whose hats are cut, rising
  Eigen::VectorXd gap;                 ///< mm, of each of them: the mean over its density; infinity: nothing bears
  Eigen::VectorXd share;               ///< of each: the part of int phi dA that bears
  Eigen::Matrix3Xd moment;             ///< mm^3, of each: its density times the place, integrated
  bool by_overlap = false;             ///< what bears depends on the depth, too
};

/// The gap (mm) at a point (barycentric) beyond which it is on the far side of the nearest step; infinity: no steps.
double threshold_at(const CrossedTriangle& crossed, const Eigen::Vector3d& point);

/// Sets what overlaps of a piece, as if its gap were linear.
void set_overlap(CoveredPiece& piece);

/// A triangle's corners as columns, mm: times a barycentric point they are its place.
Eigen::Matrix3d corners_of(const ContactSurface& surface, int triangle);

/// A triangle's cells where no hat is cut: its split into 16.
std::vector<DensityCell> whole_cells(const ContactSurface& surface, int triangle);

/// Makes the densities. `gap_at(triangle, barycentric)` is the gap over a triangle that isn't crossed, infinity for a
/// miss. `crossed` is sorted by triangle. Contact lies within the overlap: where that is narrower than a hat, as `bend`
/// says, nothing else of the hat bears.
CutHats cut_hats(const ContactSurface& surface, const std::vector<CrossedTriangle>& crossed,
                 const std::function<double(int, const Eigen::Vector3d&)>& gap_at);

/// The hats of a surface under several bodies, each as the body cuts it that `owner` says of its vertex; null: cuts
/// none. Gaps and moments are left out.
std::shared_ptr<const CutHats> joint_cuts(const ContactSurface& surface,
                                          const std::vector<std::shared_ptr<const CutHats>>& of_bodies,
                                          const std::vector<int>& owner);

/// Where a vertex is in `cuts.vertices`; -1: its hat is whole.
Eigen::Index place_in(const CutHats& cuts, int vertex);

/// The gaps of `cuts`' vertices after a small motion of the body, the hats staying as they were cut: each has changed
/// by what half of its density changed by at least and half at most. What has come to lie beyond an outline or a step
/// thus doesn't count.
Eigen::VectorXd moved_gaps(const ContactSurface& surface, const CutHats& cuts,
                           const std::function<double(int, const Eigen::Vector3d&)>& gap_at);

}  // namespace touchstone::fem
