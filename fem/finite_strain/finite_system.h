#pragma once
// The linear system of one Newton step of a finite-strain press: the gel's tangent, how far bodies shift and turn along
// the axes that are led by forces and torques, and the laws of the vertices that may touch.

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "fem/finite_strain/finite_part.h"

namespace touchstone::fem {

/// The axes of all bodies that are led by forces and torques: each body's shifts, then its turns.
std::vector<LedAxis> led_axes(std::span<const PartTarget> targets, std::span<const PressBody> bodies);

/// How a point of the body goes with the axis' unknown, mm per mm: along the axis, or round it in the distance of the
/// arm.
Eigen::Vector3d motion_along(const LedAxis& axis, const FiniteSnapshot& at, const Eigen::Vector3d& place);

/// The sum over the nodes of force times how it goes with the axis, N: a force, or a torque over the arm. `nodal`:
/// nodes x 3.
double work_along(const LedAxis& axis, const FiniteGel& gel, const FiniteSnapshot& at, const Eigen::MatrixX3d& nodal);

/// What is wanted along the axis, N: a force, or a torque over the arm.
double wanted_along(const LedAxis& axis, std::span<const PartTarget> targets);

/// Rows of laws (mm^3 per unknown's unit of the gel's length scale, over that scale: mm^2) over the gel's unknowns and,
/// behind them, those of the led axes. With c rows a vertex (1 without friction, 3 with it): the gap, and the slip in
/// two directions.
using LawRow = std::vector<std::pair<int, double>>;
/// The laws of all vertices that may touch, c rows a vertex, and behind them each led axis itself, times 1 mm^2.
struct LawRows {
  std::vector<LawRow> rows;
  int inner = 0;  ///< unknowns and led axes
};

/// `axes` per surface vertex: columns along the force of contact and two across it.
LawRows law_rows(const FiniteGel& gel, const FiniteSnapshot& at, const std::vector<Eigen::Matrix3d>& axes,
                 const std::vector<int>& block, int components, const std::vector<LedAxis>& led);

/// Adds what contact itself adds to the gel's tangent: the bodies' curvature, how forces turn with a body that turns,
/// and the stiffness of bulging edges.
void add_contact_stiffness(const FiniteGel& gel, const FiniteSnapshot& at, const std::vector<LedAxis>& led,
                           SymmetricEntries& matrix);

/// Adds factor * row row^T, upper triangle.
void add_square(const LawRow& row, double factor, SymmetricEntries& matrix);

/// N: forces are without units over this.
double force_scale(const FiniteGel& gel);

/// Over the space's unknowns, without units, of forces on the nodes (nodes x 3, N).
Eigen::VectorXd over_unknowns(const FiniteGel& gel, const Eigen::MatrixX3d& nodal);

}  // namespace touchstone::fem
