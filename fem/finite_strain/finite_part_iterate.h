#pragma once
// What FinitePartSolver holds while it solves one part; for finite_part*.cpp only.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "fem/finite_strain/finite_part.h"

namespace touchstone::fem {

/// An elastic object's own compliance, seen by the hats of some vertices where the gel's surface is.
struct FinitePartSolver::Soft {
  std::vector<int> vertices;                           ///< rising
  std::vector<std::array<Eigen::Index, 3>> triangles;  ///< of the surface, between them: places in `vertices`
  Eigen::MatrixXd compliance;                          ///< 3 m x 3 m, mm^3 per MPa, gel frame

  /// Where the vertex is among them; -1: it isn't.
  Eigen::Index place(int vertex) const {
    const auto it = std::lower_bound(vertices.begin(), vertices.end(), vertex);
    return it != vertices.end() && *it == vertex ? it - vertices.begin() : -1;
  }
};

/// One Newton iterate, and what is known there.
struct FinitePartSolver::Iterate {
  FiniteSnapshot at;
  std::vector<LedAxis> led;                       ///< of the part
  std::vector<GapLines> lines;                    ///< per body
  std::vector<std::shared_ptr<const Soft>> soft;  ///< per body, of an elastic one, along its lines
  Eigen::MatrixX3d face;                          ///< n x 3, likewise: how what it gives changes along the surface
  std::vector<Eigen::Matrix3d> axes;              ///< per vertex; only where it has a gap
  Eigen::VectorXd inside;                         ///< residual without the tractions of contact
  Eigen::VectorXd bulges;                         ///< per led axis: the work of bulge_forces along it, N
  Eigen::VectorXd along;                          ///< per led axis: what acts on the body, N
  Eigen::VectorXd tangential_scale;               ///< mm^3 per MPa, per vertex, of the last compliance
  double balance = 0.0;                           ///< residual over the elements' forces
  double size = 0.0;                              ///< those forces
  double least_size = 0.0;                        ///< what `balance` takes for them at least: a gel that is let go
                                                  ///< comes to rest, where there are none
  double least = 0.0;                             ///< J
};

}  // namespace touchstone::fem
