#pragma once
// Smooth fields over a rectangle, and how they are fitted to means over a mesh's hat functions.

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <span>

#include "fem/fine_relief/layer_response.h"

namespace touchstone::fem {

/// A field of three components on uniform bicubic B-splines, twice continuously differentiable.
struct SplineField {
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< knot (0, 0), mm
  double spacing = 1.0;                             ///< mm between knots
  int nx = 0;                                       ///< intervals between knots
  int ny = 0;
  Eigen::MatrixX3d coefficients;  ///< of splines about knots -1 to nx + 1, -1 to ny + 1, x fastest

  /// Beyond the rectangle: the value at its nearest point.
  Eigen::Vector3d at(const Eigen::Vector2d& point) const;
  /// The values at all points (x, y) of a lattice, x fastest; a fraction of the work of asking for each.
  Eigen::MatrixX3d on_lattice(std::span<const double> x, std::span<const double> y) const;
  /// The knot that the spline of a row of `coefficients` stands about. A field whose coefficients are a linear
  /// function's values at these is that function.
  Eigen::Vector2d knot(Eigen::Index row) const;
};

/// Fits fields to means over hat functions: least squares weighted by the hats' areas, bending held back such that
/// waves of `half_wave` mm are followed by half, and waves of half that length by 1/17.
class SplineFit {
 public:
  /// `hats` (pixels x hats) holds the hat functions at the centres of `grid`'s pixels; `weight` the hats' areas. A hat
  /// that no pixel lies in doesn't count. The knots are `spacing` apart over the rectangle from `low` to `high`.
  SplineFit(const PixelGrid& grid, const Eigen::SparseMatrix<double, Eigen::RowMajor>& hats,
            const Eigen::VectorXd& weight, const Eigen::Vector2d& low, const Eigen::Vector2d& high, double spacing,
            double half_wave);

  /// @pre a row of `means` per hat
  SplineField fit(const Eigen::MatrixX3d& means) const;
  /// A field's means over the hats.
  Eigen::MatrixX3d means_of(const SplineField& field) const { return means_ * field.coefficients; }

 private:
  SplineField empty_;
  Eigen::VectorXd weight_;
  Eigen::SparseMatrix<double> means_;  // hats x splines
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

}  // namespace touchstone::fem
