#include "fem/elements/surface_compliance.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/error.h"

namespace touchstone::fem {

Eigen::Index SurfaceCompliance::rows() const {
  return whole() != nullptr ? whole()->rows() : compressed()->rows();
}

Eigen::VectorXd SurfaceCompliance::times(const Eigen::Ref<const Eigen::VectorXd>& traction) const {
  TS_ASSERT(traction.size() == rows());
  if (whole() == nullptr) return compressed()->times(traction);
  const SharedMatrix::View matrix = whole()->view();
  Eigen::VectorXd result = Eigen::VectorXd::Zero(rows());
  for (Eigen::Index first = 0; first < rows(); first += 3) {
    const Eigen::Vector3d own = traction.segment<3>(first);
    if (!own.isZero(0.0)) result.noalias() += matrix.middleCols<3>(first) * own;
  }
  return result;
}

Eigen::MatrixXd SurfaceCompliance::times_along(int axis, const Eigen::MatrixXd& tractions) const {
  TS_ASSERT(axis >= 0 && axis < 3 && 3 * tractions.rows() == rows());
  if (whole() != nullptr) {
    // It is large: read once for all columns.
    using Columns = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
    return Columns(view().data() + axis * rows(), rows(), rows() / 3, Eigen::OuterStride<>(3 * rows())) * tractions;
  }
  Eigen::MatrixXd result(rows(), tractions.cols());
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(rows());
  for (Eigen::Index j = 0; j < tractions.cols(); ++j) {
    traction(Eigen::seqN(axis, tractions.rows(), Eigen::fix<3>)) = tractions.col(j);
    result.col(j) = times(traction);
  }
  return result;
}

Eigen::MatrixXd SurfaceCompliance::block(std::span<const int> rows, std::span<const int> columns) const {
  if (whole() == nullptr) return compressed()->block(rows, columns);
  const SharedMatrix::View matrix = whole()->view();
  Eigen::MatrixXd result(3 * std::ssize(rows), 3 * std::ssize(columns));
  for (std::ptrdiff_t j = 0; j < std::ssize(columns); ++j) {
    for (std::ptrdiff_t i = 0; i < std::ssize(rows); ++i) {
      result.block<3, 3>(3 * i, 3 * j) = matrix.block<3, 3>(3 * rows[i], 3 * columns[j]);
    }
  }
  return result;
}

SurfaceCompliance SurfaceCompliance::scaled(double factor) const {
  if (whole() == nullptr) return compressed()->scaled(factor);
  return Eigen::MatrixXd(factor * whole()->view());
}

SurfaceCompliance SurfaceCompliance::mirrored(const Eigen::Vector3d& signs) const {
  if (whole() == nullptr) return compressed()->mirrored(signs);
  Eigen::MatrixXd matrix = whole()->view();
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) matrix(i, j) *= signs[i % 3] * signs[j % 3];
  }
  return matrix;
}

double SurfaceCompliance::bytes() const {
  return sizeof(double) *
         static_cast<double>(whole() != nullptr ? whole()->size() : compressed()->parts().numbers.size());
}

}  // namespace touchstone::fem
