#include "fem/contact/keep_definite.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/dense_solvers.h"

namespace touchstone::fem {
namespace {

constexpr double kOwnPart = 0.01;  // of a cut hat's response: so much at least is what no others can do

/// What must be added to the diagonal so that each pivot of a Cholesky factor is at least this: nothing where one would
/// have to be more than doubled, for then the factor's numbers grow from pivot to pivot without bound.
std::optional<Eigen::VectorXd> softened_one_by_one(Eigen::MatrixXd left, const Eigen::VectorXd& least) {
  const Eigen::Index n = left.rows();
  Eigen::VectorXd more(n);
  // The factor takes the place of the lower half, column by column.
  for (Eigen::Index j = 0; j < n; ++j) {
    left.col(j).tail(n - j).noalias() -= left.bottomLeftCorner(n - j, j) * left.row(j).head(j).transpose();
    more[j] = std::max(0.0, least[j] - left(j, j));
    if (!(more[j] < least[j] / kOwnPart)) return std::nullopt;
    left(j, j) += more[j];
    left.col(j).tail(n - j) /= std::sqrt(left(j, j));
  }
  return more;
}

/// What must be added so that no eigenvalue is smaller than this, rows and columns being scaled by its root.
Eigen::MatrixXd softened_together(const Eigen::MatrixXd& left, const Eigen::VectorXd& least) {
  const Eigen::VectorXd scale = least.cwiseSqrt();
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * left * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(scaled);
  const Eigen::MatrixXd vectors = scale.asDiagonal() * modes.eigenvectors();
  return vectors * (1.0 - modes.eigenvalues().array()).max(0.0).matrix().asDiagonal() * vectors.transpose();
}

}  // namespace

void keep_definite(Eigen::MatrixXd& compliance, const std::vector<Eigen::Index>& whole,
                   const std::vector<Eigen::Index>& cut) {
  Eigen::MatrixXd left = compliance(cut, cut);
  if (!whole.empty()) {
    const Eigen::LLT<Eigen::MatrixXd> factor(compliance(whole, whole));
    if (factor.info() != Eigen::Success) return;  // not by what cuts changed
    const Eigen::MatrixXd through = factor.matrixL().solve(Eigen::MatrixXd(compliance(whole, cut)));
    left.noalias() -= through.transpose() * through;
  }
  Eigen::VectorXd least(left.rows());
  for (Eigen::Index j = 0; j < least.size(); ++j) {
    const Eigen::Index row = cut[static_cast<std::size_t>(j)];
    least[j] = kOwnPart * std::abs(compliance(row, row));
  }
  if (const std::optional<Eigen::VectorXd> more = softened_one_by_one(left, least)) {
    for (Eigen::Index j = 0; j < least.size(); ++j) {
      compliance(cut[static_cast<std::size_t>(j)], cut[static_cast<std::size_t>(j)]) += (*more)[j];
    }
  } else {
    compliance(cut, cut) += softened_together(left, least);
  }
}

}  // namespace touchstone::fem
