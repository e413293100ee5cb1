#pragma once
// The linear system of one Newton step of a finite-strain press: the gel's tangent, the object's shift along the axes
// that are force-controlled, and the laws of the vertices that may touch.

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "fem/finite_strain/finite_part.h"

namespace touchstone::fem {

/// Rows of laws (mm^3 per unknown's unit of the gel's length scale, over that scale: mm^2) over the gel's unknowns and,
/// behind them, the object's shifts. With c rows a vertex (1 without friction, 3 with it): the gap, and the slip in
/// two directions.
using LawRow = std::vector<std::pair<int, double>>;
/// The laws of all vertices that may touch, c rows a vertex, and behind them each shift itself, times 1 mm^2.
struct LawRows {
  std::vector<LawRow> rows;
  int inner = 0;  ///< unknowns and shifts
};

/// `axes` per surface vertex: columns along the force of contact and two across it. `forced`: the axes whose forces are
/// given, rising.
LawRows law_rows(const FiniteGel& gel, const DeformedGap& gap, const std::vector<Eigen::Matrix3d>& axes,
                 const std::vector<int>& block, int components, const std::vector<int>& forced);

/// Adds what contact itself adds to the gel's tangent: the body's curvature, and the stiffness of bulging edges.
void add_contact_stiffness(const FiniteGel& gel, const DeformedGap& gap, const std::vector<int>& forced,
                           SymmetricEntries& matrix);

/// Adds factor * row row^T, upper triangle.
void add_square(const LawRow& row, double factor, SymmetricEntries& matrix);

/// N: forces are without units over this.
double force_scale(const FiniteGel& gel);

/// Over the space's unknowns, without units, of forces on the nodes (nodes x 3, N).
Eigen::VectorXd over_unknowns(const FiniteGel& gel, const Eigen::MatrixX3d& nodal);

}  // namespace touchstone::fem
