#include "fem/contact/smooth_rest.h"

#include <array>
#include <cmath>

#include "core/dense_solvers.h"

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kRingFrom = 1.6;  // edges
constexpr double kRingTo = 3.3;
constexpr int kLeastRing = 12;
constexpr double kOneSided = 0.5;  // edges: a ring's middle that is farther away than that isn't all round

}  // namespace

bool SmoothRest::fit(int vertex) {
  vertex_ = vertex;
  edge_ = edge_at(vertex);
  std::vector<int> ring;
  for (int v = 0; v < static_cast<int>(surface_.vertices.size()); ++v) {
    const double distance = (surface_.vertices[v] - surface_.vertices[vertex]).norm();
    if (distance > kRingFrom * edge_ && distance < kRingTo * edge_) ring.push_back(v);
  }
  if (static_cast<int>(ring.size()) < kLeastRing) return false;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const int v : ring) middle += along(v) / static_cast<double>(ring.size());
  if (middle.norm() > kOneSided * edge_) return false;
  Eigen::MatrixXd basis(static_cast<Eigen::Index>(ring.size()), 6);
  Eigen::MatrixXd rest(basis.rows(), 9);
  const Eigen::MatrixXd compliance = gel_.surface.block(ring, std::array{vertex});
  for (Eigen::Index k = 0; k < basis.rows(); ++k) {
    const int v = ring[static_cast<std::size_t>(k)];
    basis.row(k) = terms(v);
    const Matrix3d own = axes_[v].transpose() * (compliance.middleRows<3>(3 * k) * axes_[vertex]);
    const Matrix3d difference = own / (surface_.weight[v] * surface_.weight[vertex]) - half_space_at(v);
    rest.row(k) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(difference.data());
  }
  coefficients_ = Eigen::MatrixXd(basis.colPivHouseholderQr().solve(rest));
  return true;
}

Matrix3d SmoothRest::at(int v) const {
  const Eigen::Matrix<double, 1, 9> row = terms(v) * coefficients_;
  return Eigen::Map<const Matrix3d>(row.data());
}

double SmoothRest::edge_at(int vertex) const {
  double sum = 0.0;
  for (const int u : surface_.around[vertex]) sum += (surface_.vertices[u] - surface_.vertices[vertex]).norm();
  return sum / static_cast<double>(surface_.around[vertex].size());
}

Eigen::Vector2d SmoothRest::along(int v) const {
  const Vector3d from = surface_.vertices[v] - surface_.vertices[vertex_];
  return {axes_[vertex_].col(1).dot(from), axes_[vertex_].col(2).dot(from)};
}

Eigen::Matrix<double, 1, 6> SmoothRest::terms(int v) const {
  const Eigen::Vector2d d = along(v) / edge_;
  Eigen::Matrix<double, 1, 6> t;
  t << 1.0, d.x(), d.y(), d.x() * d.x(), d.y() * d.y(), d.x() * d.y();
  return t;
}

/// A half-space's, hats taken as points with their spread: variance e^2 5/48 along each axis, for regular triangles.
Matrix3d SmoothRest::half_space_at(int v) const {
  constexpr double kHatSpread = 5.0 / 48.0;
  const double e = edge_at(v);
  const double spread = 0.5 * kHatSpread * (e * e + edge_ * edge_);
  const Eigen::Vector2d d = along(v);
  const double r2 = (surface_.vertices[v] - surface_.vertices[vertex_]).squaredNorm();
  const double r3 = r2 * std::sqrt(r2);
  Matrix3d u = half_space_.between(d.x(), d.y(), r2);
  Matrix3d more = Matrix3d::Identity() * (1.0 - half_space_.nu) / r3;
  const Eigen::Matrix2d tangent = (2.0 * Eigen::Matrix2d::Identity() - 3.0 * d * d.transpose() / r2) / r3;
  // The Laplacians of x x / r^3 and x y / r^3; of x / r^2 there is none.
  more(1, 1) += half_space_.nu * tangent(0, 0);
  more(2, 2) += half_space_.nu * tangent(1, 1);
  more(1, 2) += half_space_.nu * (tangent(0, 1));
  more(2, 1) += half_space_.nu * (tangent(1, 0));
  return u + half_space_.scale * half_space_.faded(std::sqrt(r2)) * spread * more;
}

}  // namespace touchstone::fem
