#pragma once
// What the gel's outer surface does under tractions: all that contact needs to know of the elastic body.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "fem/elastic_material.h"

namespace touchstone::fem {

/// A rigid ball inside the gel, seen as a marker. Gel frame, mm.
struct Bead {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0.0;
};

/// Linear response of the gel to tractions on its outer surface, which are P1 on its triangles. Degree of freedom
/// 3*i + a is component a (gel frame) at surface vertex i.
struct Compliance {
  double thickness = 0.0;  ///< mm
  ElasticMaterial material;
  std::vector<Eigen::Vector3d> vertices;         ///< n vertices of the outer surface, mm
  std::vector<std::array<int, 3>> triangles;     ///< over `vertices`, normal out
  Eigen::SparseMatrix<double> mass;              ///< n x n: int phi_i phi_j dA, mm^2 (P1 hats); its row sums are the weights
  Eigen::MatrixXd surface;                       ///< 3n x 3n, symmetric positive definite: int phi_i u_a dA (mm^3) per traction (MPa)
  Eigen::MatrixXd beads;                         ///< 3m x 3n: mean displacement of a bead's surface (mm) per traction (MPa)
};

}  // namespace touchstone::fem
