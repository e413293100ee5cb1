#pragma once
// The compliance between the vertices of a surface, whole or with its far parts compressed.

#include <Eigen/Core>
#include <span>
#include <variant>

#include "fem/elements/far_field_matrix.h"
#include "fem/elements/shared_matrix.h"

namespace touchstone::fem {

/// A symmetric matrix with three rows and columns for each vertex, that is never changed once it is here.
class SurfaceCompliance {
 public:
  /// Of size 0.
  SurfaceCompliance() = default;
  SurfaceCompliance(SharedMatrix whole) : matrix_(std::move(whole)) {}  // NOLINT: a matrix is one of these
  SurfaceCompliance(Eigen::MatrixXd whole) : matrix_(SharedMatrix(std::move(whole))) {}  // NOLINT: likewise
  SurfaceCompliance(FarFieldMatrix compressed) : matrix_(std::move(compressed)) {}       // NOLINT: likewise

  /// Three for each vertex.
  Eigen::Index rows() const;
  /// All of it; null where its far parts are compressed.
  const SharedMatrix* whole() const { return std::get_if<SharedMatrix>(&matrix_); }
  const FarFieldMatrix* compressed() const { return std::get_if<FarFieldMatrix>(&matrix_); }
  /// The numbers of a whole one, where they lie. @pre whole()
  SharedMatrix::View view() const { return std::get<SharedMatrix>(matrix_).view(); }

  /// The matrix times tractions, of which most may be zero.
  Eigen::VectorXd times(const Eigen::Ref<const Eigen::VectorXd>& traction) const;
  /// Columns of tractions along one axis (0 to 2), one number a vertex.
  Eigen::MatrixXd times_along(int axis, const Eigen::MatrixXd& tractions) const;
  /// Three rows and columns for each of these vertices; each list without repeats.
  Eigen::MatrixXd block(std::span<const int> rows, std::span<const int> columns) const;
  /// The same times a number.
  SurfaceCompliance scaled(double factor) const;
  /// Of the surface mirrored or turned by half a turn: `signs` are those of the three components.
  SurfaceCompliance mirrored(const Eigen::Vector3d& signs) const;
  /// Bytes of its numbers.
  double bytes() const;

 private:
  std::variant<SharedMatrix, FarFieldMatrix> matrix_;
};

}  // namespace touchstone::fem
