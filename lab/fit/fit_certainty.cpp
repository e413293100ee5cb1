#include "lab/fit/fit_certainty.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr double kExact = 1e-7;   // of the largest singular value: below, rounding and finite differences
constexpr double kNoPart = 1e-5;  // of a direction of length 1
constexpr int kSpareTiles = 2;    // more than variables

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

double root_mean_square(double squares, int count, double used) {
  return count > 0 ? std::sqrt(squares / std::max(1.0, count - used)) : 0.0;
}

/// The sum over the rows of a kind of w_i j_i j_i^T.
Matrix part_of(const LinearisedFit& fit, bool pictures) {
  Matrix rows(fit.jacobian.rows(), fit.jacobian.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < fit.jacobian.rows(); ++i) {
    if ((fit.tile[static_cast<std::size_t>(i)] >= 0) == pictures) rows.row(count++) = fit.jacobian.row(i);
  }
  return rows.topRows(count).transpose() * rows.topRows(count);
}

/// Variances of the shared variables by leaving out one tile after the other; the others are held where they are. In
/// directions that aren't identified it says nothing.
Vector jackknife(const LinearisedFit& fit, double misfit) {
  const Eigen::Index n = fit.jacobian.cols();
  const Eigen::Index shared = std::min<Eigen::Index>(fit.shared, n);
  Vector variance = Vector::Zero(n);
  if (shared == 0) return variance;
  const Matrix own = fit.jacobian.leftCols(shared);
  const Eigen::SelfAdjointEigenSolver<Matrix> parts(Matrix(own.transpose() * own));
  std::vector<Eigen::Index> known;
  for (Eigen::Index k = 0; k < shared; ++k) {
    if (std::sqrt(std::max(0.0, parts.eigenvalues()[k])) > kNormal95 * misfit) known.push_back(k);
  }
  const auto count = static_cast<Eigen::Index>(known.size());
  Matrix basis(shared, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    basis.col(i) = parts.eigenvectors().col(known[static_cast<std::size_t>(i)]);
  }
  const Matrix reduced = own * basis;
  const Matrix all = reduced.transpose() * reduced;
  std::vector<Matrix> squares(static_cast<std::size_t>(fit.tiles), Matrix::Zero(count, count));
  std::vector<Vector> pulls(static_cast<std::size_t>(fit.tiles), Vector::Zero(count));
  for (Eigen::Index i = 0; i < reduced.rows(); ++i) {
    const int tile = fit.tile[static_cast<std::size_t>(i)];
    if (tile < 0) continue;
    squares[static_cast<std::size_t>(tile)].noalias() += reduced.row(i).transpose() * reduced.row(i);
    pulls[static_cast<std::size_t>(tile)] += fit.residuals[i] * reduced.row(i).transpose();
  }
  std::vector<Vector> moves;
  for (std::size_t tile = 0; tile < squares.size(); ++tile) {
    if (squares[tile].isZero(0.0)) continue;
    // At the minimum the whole pull is zero: without the tile it's minus the tile's.
    const Vector move = (all - squares[tile]).ldlt().solve(pulls[tile]);
    if (move.allFinite()) moves.emplace_back(basis * move);
  }
  const auto tiles = static_cast<double>(moves.size());
  if (tiles < static_cast<double>(count + kSpareTiles)) return variance;
  Vector mean = Vector::Zero(shared);
  for (const Vector& move : moves) mean += move / tiles;
  for (const Vector& move : moves) variance.head(shared) += (move - mean).cwiseAbs2() * ((tiles - 1.0) / tiles);
  return variance;
}

/// By how much the sums of residuals over patches scatter more than those of as many that know nothing of each other.
double alike_of(const LinearisedFit& fit) {
  std::map<int, double> sums;
  double squares = 0.0, of_sums = 0.0;
  for (std::size_t i = 0; i < fit.patch.size(); ++i) {
    if (fit.tile[i] < 0) continue;
    const double residual = fit.residuals[static_cast<Eigen::Index>(i)];
    sums[fit.patch[i]] += residual;
    squares += residual * residual;
  }
  for (const auto& [patch, sum] : sums) of_sums += sum * sum;
  return squares > 0.0 ? std::sqrt(std::max(1.0, of_sums / squares)) : 1.0;
}

}  // namespace

FitCertainty certainty_of(const LinearisedFit& fit) {
  const Eigen::Index rows = fit.jacobian.rows(), n = fit.jacobian.cols();
  TS_ASSERT(rows > 0 && n > 0 && fit.residuals.size() == rows && static_cast<Eigen::Index>(fit.tile.size()) == rows);
  FitCertainty out;
  double squares[2] = {0.0, 0.0};
  int counts[2] = {0, 0};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const int kind = fit.tile[static_cast<std::size_t>(i)] >= 0 ? 0 : 1;
    squares[kind] += fit.residuals[i] * fit.residuals[i];
    ++counts[kind];
  }
  // Which kind of rows a variable uses up isn't distinguished: pictures have them in plenty, numbers few.
  out.picture_misfit = root_mean_square(squares[0], counts[0], static_cast<double>(n));
  out.number_misfit = root_mean_square(squares[1], counts[1], 0.0);

  // Singular values by the triangle of a QR, so that they aren't squared in between.
  Matrix triangle = fit.jacobian;
  if (rows > n)
    triangle = Eigen::HouseholderQR<Matrix>(fit.jacobian).matrixQR().topRows(n).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Matrix> svd(triangle, Eigen::ComputeFullV);
  const Matrix& V = svd.matrixV();
  Vector singular = Vector::Zero(n);
  singular.head(svd.singularValues().size()) = svd.singularValues();
  const double least = kExact * std::max(singular[0], 1e-300);

  const double inflate[2] = {std::pow(std::max(1.0, out.picture_misfit), 2),
                             std::pow(std::max(1.0, out.number_misfit), 2)};
  const Matrix pictures = part_of(fit, true) * inflate[0], numbers = part_of(fit, false) * inflate[1];
  out.alike = alike_of(fit);
  const Matrix noise = pictures + numbers;
  std::vector<Eigen::Index> known, unknown;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double spread = singular[k] > least ? std::sqrt(V.col(k).dot(noise * V.col(k))) / (singular[k] * singular[k])
                                              : std::numeric_limits<double>::infinity();
    (kNormal95 * spread < 1.0 ? known : unknown).push_back(k);
  }
  const auto columns = [&](const std::vector<Eigen::Index>& which) {
    Matrix out_columns(n, static_cast<Eigen::Index>(which.size()));
    for (std::size_t i = 0; i < which.size(); ++i) out_columns.col(static_cast<Eigen::Index>(i)) = V.col(which[i]);
    return out_columns;
  };
  out.unidentified = columns(unknown);
  const Matrix basis = columns(known);

  out.by_noise = out.by_model = out.by_light = out.by_mesh = Vector::Zero(n);
  if (!known.empty()) {
    Vector inverse(static_cast<Eigen::Index>(known.size()));
    for (std::size_t i = 0; i < known.size(); ++i)
      inverse[static_cast<Eigen::Index>(i)] = 1.0 / (singular[known[i]] * singular[known[i]]);
    const Matrix solve = basis * inverse.asDiagonal() * basis.transpose();  // (J^T J)^-1 where it is known
    Vector variance = (solve * noise * solve).diagonal();
    const Vector of_pictures = (solve * pictures * solve).diagonal();
    for (Eigen::Index i = fit.shared; i < n; ++i) variance[i] += (out.alike * out.alike - 1.0) * of_pictures[i];
    out.by_noise = variance.cwiseMax(0.0).cwiseSqrt();
    out.by_model = jackknife(fit, std::max(1.0, out.picture_misfit)).cwiseSqrt();
    const auto moved_by = [&](const Vector& error) {
      return error.size() == rows ? Vector((solve * (fit.jacobian.transpose() * error)).cwiseAbs())
                                  : Vector(Vector::Zero(n));
    };
    out.by_light = moved_by(fit.light_error);
    out.by_mesh = moved_by(fit.mesh_error);
  }
  out.deviation = (out.by_noise.cwiseMax(out.by_model).cwiseAbs2() + out.by_light.cwiseAbs2() + out.by_mesh.cwiseAbs2())
                      .cwiseSqrt();
  for (Eigen::Index i = 0; i < n; ++i) {
    double free = 0.0;
    for (const Eigen::Index k : unknown) {
      const double part = std::abs(V(i, k));
      if (part < kNoPart) continue;
      const double spread = singular[k] > least
                                ? std::sqrt(V.col(k).dot(noise * V.col(k))) / (singular[k] * singular[k])
                                : std::numeric_limits<double>::infinity();
      free = std::hypot(free, part * spread);
    }
    out.deviation[i] = std::hypot(out.deviation[i], free);
    out.identified.push_back(kNormal95 * out.deviation[i] < 1.0 ? 1 : 0);
    if (out.identified.back() == 0) out.deviation[i] = std::numeric_limits<double>::infinity();
  }
  return out;
}

}  // namespace touchstone::lab
