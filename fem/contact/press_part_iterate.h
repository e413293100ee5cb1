#pragma once
// What PartSolver holds while it solves one part; for press_part*.cpp only.

#include <limits>
#include <vector>

#include "fem/contact/press_part.h"

namespace touchstone::fem {

/// Vertices further from a body than this part of the gel's thickness aren't looked at to begin with.
inline constexpr double kLeastReach = 0.02;

/// Where a gap was looked up, so that it serves again nearby: exactly after a motion along the normal of a flat
/// surface, to second order after a small one across it.
struct PartSolver::CachedGap {
  bool valid = false;
  RigidTransform pose;
  PatchMotion lookup;
  WeightedGap gap;
  RigidTransform cut_pose;  ///< where gap.cuts were made
  PatchMotion cut_lookup;
  double cut_depth = 0.0;  ///< mm
  bool has_slopes = false;
  Eigen::MatrixX2d plain_slope;  ///< n x 2: change of gap.plain per mm that the gel goes along x, y
  Eigen::MatrixX2d edge_slope;
};

/// What changes for one body while a part is solved.
struct PartSolver::Body {
  RigidTransform pose;
  Eigen::Vector3d turn;
  PatchMotion lookup;       ///< how the gel under it is carried along
  PatchMotion next_lookup;  ///< of the next update
  std::array<double, 3> last_residual{};
  bool has_residual = false;
  double relaxation = 1.0;
  double patch_radius = 1.0;  ///< mm
  bool touching = false;
  WeightedGap gap;  ///< after the last shift
};

/// One iterate: where the bodies are looked up, and the block of vertices that may touch.
struct PartSolver::Iterate {
  std::vector<Body> bodies;
  double lookup_error = 0.0;
  double reach = 0.0;          ///< mm
  std::vector<int> owner;      ///< per vertex: the body with the least gap there, -1: far from all
  std::vector<char> active;    ///< vertices in contact
  std::vector<char> required;  ///< vertices that turned out to be needed in the block
  Eigen::VectorXd traction;    ///< to begin the next solution with
  Eigen::VectorXd weighted;    ///< 3 m, of the gel at the block's vertices, gel frame
  bool warm = false;
  bool grew = false;  ///< `required` was added to, or the pose isn't an answer yet
  int updates = 0;
  int at_the_bottom = 0;     ///< updates that wanted to go deeper than the gel
  double edge_change = 0.0;  ///< mm: what the shift does to the gaps beyond moving them
  double deepest = 0.0;

  double gap(int v) const {
    return owner[v] < 0 ? std::numeric_limits<double>::infinity() : bodies[owner[v]].gap.weighted[v];
  }
};

}  // namespace touchstone::fem
