#pragma once
// What tractions on the cells of one surface triangle do at those of another.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fem/contact/cut_hats.h"
#include "fem/contact/far_densities.h"
#include "fem/contact/half_space_response.h"

namespace touchstone::fem {

/// Cells side by side, so that loops over them run on several numbers at once.
struct CellColumns {
  explicit CellColumns(const std::vector<DensityCell>& list);  ///< in their order

  int size() const { return static_cast<int>(area.size()); }

  Eigen::ArrayX3d at;        ///< mm
  Eigen::ArrayXd area;       ///< mm^2
  Eigen::ArrayXd largest;    ///< mm^-1: mean of 1/r within each
  Eigen::MatrixX3d density;  ///< mm^2, of each corner
};

/// A triangle's cells with what they add up to.
struct TriangleDensity {
  explicit TriangleDensity(const std::vector<DensityCell>& list);  ///< of these

  CellColumns cells;
  std::array<DensityMoments, 3> corner;  ///< of each corner's density
};

/// One triangle among those of a contact.
struct DensityTriangle {
  /// `cut`: with its hats cut; `whole`: as if they weren't.
  DensityTriangle(const std::vector<DensityCell>& cut, const std::vector<DensityCell>& whole);

  TriangleDensity now;
  TriangleDensity whole;
  bool same_cells;  ///< of both
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();  ///< tangents
  std::array<int, 3> place{-1, -1, -1};  ///< of its corners among the contact's vertices; -1: not one of them
};

/// One vertex among those of a contact.
struct DensityVertex {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();  ///< tangents
  bool is_cut = false;                                                                ///< its hat
};

/// A half-space's responses to densities, with hats cut and whole: mm^3/MPa, a row for each vertex if only normal ones
/// are asked for, else three (pressure and two tangents). 0 between vertices that aren't cut, for there is no
/// difference. Both are symmetric.
struct DensityResponses {
  Eigen::MatrixXd cut;
  Eigen::MatrixXd whole;
};

/// Of vertices that are far apart by their densities' moments, else triangle by triangle: near ones cell by cell, the
/// others by their densities' centres. `triangles`: all around the vertices that may be cut. `edge`: the triangles',
/// mm, by which near and far are told.
DensityResponses density_responses(const HalfSpaceResponse& half_space, const std::vector<DensityVertex>& vertices,
                                   const std::vector<DensityTriangle>& triangles, double edge, bool normal_only);

}  // namespace touchstone::fem
