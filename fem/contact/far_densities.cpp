#include "fem/contact/far_densities.h"

#include <array>
#include <cmath>

#include "core/wide_clones.h"

namespace touchstone::fem {
namespace {

/// Columns of what is known of each pair: the centres' distance, then the sum of the spreads (xx, xy, xz, yy, yz, zz).
constexpr int kPairColumns = 9;
/// Of where its four points lie: the distance along both tangents, that off their plane squared, and the steps.
constexpr int kPlaceColumns = 6;

/// The points of each pair. `axes`: the tangents, one after the other.
TS_WIDE_CLONES void place_points(const double* axes, const double* __restrict pairs, int count,
                                 double* __restrict place) {
  const double* const dx = pairs;
  const double* const dy = pairs + count;
  const double* const dz = pairs + 2 * count;
  const double* const xx = pairs + 3 * count;
  const double* const xy = pairs + 4 * count;
  const double* const xz = pairs + 5 * count;
  const double* const yy = pairs + 6 * count;
  const double* const yz = pairs + 7 * count;
  const double* const zz = pairs + 8 * count;
  double* const x = place;
  double* const y = place + count;
  double* const off2 = place + 2 * count;
  double* const step_x = place + 3 * count;
  double* const step_y = place + 4 * count;
  double* const other_y = place + 5 * count;
  const double a = axes[0], b = axes[1], c = axes[2], d = axes[3], e = axes[4], f = axes[5];
#pragma GCC ivdep
  for (int j = 0; j < count; ++j) {
    x[j] = a * dx[j] + b * dy[j] + c * dz[j];
    y[j] = d * dx[j] + e * dy[j] + f * dz[j];
    const double off = dx[j] * dx[j] + dy[j] * dy[j] + dz[j] * dz[j] - (x[j] * x[j] + y[j] * y[j]);
    off2[j] = off > 0.0 ? off : 0.0;
    // The spread's root along the tangents, by Cholesky.
    const double of_first_x = a * xx[j] + b * xy[j] + c * xz[j];
    const double of_first_y = a * xy[j] + b * yy[j] + c * yz[j];
    const double of_first_z = a * xz[j] + b * yz[j] + c * zz[j];
    const double of_second_x = d * xx[j] + e * xy[j] + f * xz[j];
    const double of_second_y = d * xy[j] + e * yy[j] + f * yz[j];
    const double of_second_z = d * xz[j] + e * yz[j] + f * zz[j];
    const double s11 = a * of_first_x + b * of_first_y + c * of_first_z;
    const double s12 = d * of_first_x + e * of_first_y + f * of_first_z;
    const double s22 = d * of_second_x + e * of_second_y + f * of_second_z;
    const double twice = 2.0 * (s11 > 1e-100 ? s11 : 1e-100);
    step_x[j] = std::sqrt(twice);
    step_y[j] = 2.0 * s12 / step_x[j];
    const double rest = 2.0 * s22 - step_y[j] * step_y[j];
    other_y[j] = std::sqrt(rest > 0.0 ? rest : 0.0);
  }
}

/// How far one of the points of each pair is: `first` and `other` are -1, 0 or 1.
TS_WIDE_CLONES void distances(const double* __restrict place, int count, double first, double other,
                              double* __restrict r) {
  for (int j = 0; j < count; ++j) {
    const double x = place[j] + first * place[3 * count + j];
    const double y = place[count + j] + first * place[4 * count + j] + other * place[5 * count + j];
    r[j] = std::sqrt(x * x + y * y + place[2 * count + j]);
  }
}

/// Adds a point's part, times `weight`, of normal responses.
TS_WIDE_CLONES void add_normal(double nu, const double* __restrict r, const double* __restrict weight, int count,
                               double* __restrict terms) {
  for (int j = 0; j < count; ++j) terms[j] += weight[j] * (1.0 - nu) / r[j];
}

/// Adds a point's part, times `weight`, of all terms.
TS_WIDE_CLONES void add_terms(double nu, const double* __restrict place, double first, double other,
                              const double* __restrict r, const double* __restrict weight, int count,
                              double* __restrict terms) {
#pragma GCC ivdep
  for (int j = 0; j < count; ++j) {
    const double x = place[j] + first * place[3 * count + j];
    const double y = place[count + j] + first * place[4 * count + j] + other * place[5 * count + j];
    const ResponseTerms at(nu, x, y, 1.0 / r[j]);
    terms[j] += weight[j] * at.normal;
    terms[count + j] += weight[j] * at.first;
    terms[2 * count + j] += weight[j] * at.second;
    terms[3 * count + j] += weight[j] * at.first_first;
    terms[4 * count + j] += weight[j] * at.first_second;
    terms[5 * count + j] += weight[j] * at.second_second;
  }
}

}  // namespace

void DensityMoments::add(const DensityMoments& other) {
  if (!(other.mass > 0.0)) return;
  const double sum = mass + other.mass;
  const Eigen::Vector3d apart = other.centre - centre;
  const double share = other.mass / sum;
  // Steiner's theorem.
  spread = (1.0 - share) * spread + share * other.spread + (1.0 - share) * share * apart * apart.transpose();
  centre += share * apart;
  mass = sum;
}

const Eigen::ArrayXXd& FarDensities::responses(const DensityMoments& a, const Eigen::Vector3d& first,
                                               const Eigen::Vector3d& second,
                                               const std::vector<const DensityMoments*>& others) {
  const auto n = static_cast<Eigen::Index>(others.size());
  const int count = static_cast<int>(n);
  const int terms = normal_only_ ? 1 : kTerms;
  pairs_.resize(n, kPairColumns);
  place_.resize(n, kPlaceColumns);
  terms_.setZero(n, terms);
  distance_.resize(n);
  weight_.resize(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const DensityMoments& b = *others[static_cast<std::size_t>(j)];
    for (int axis = 0; axis < 3; ++axis) pairs_(j, axis) = a.centre[axis] - b.centre[axis];
    int column = 3;
    for (int row = 0; row < 3; ++row) {
      for (int other = row; other < 3; ++other) pairs_(j, column++) = a.spread(row, other) + b.spread(row, other);
    }
  }
  const std::array<double, 6> axes{first[0], first[1], first[2], second[0], second[1], second[2]};
  place_points(axes.data(), pairs_.data(), count, place_.data());
  constexpr std::array<std::array<double, 2>, 4> kPoints{{{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}}};
  for (const auto& [along_first, along_other] : kPoints) {
    double* const r = distance_.data();
    distances(place_.data(), count, along_first, along_other, r);
    for (Eigen::Index j = 0; j < n; ++j) {
      const double mass = a.mass * others[static_cast<std::size_t>(j)]->mass;
      weight_[j] = 0.25 * half_space_.scale * mass * half_space_.faded(r[j]);
    }
    if (normal_only_) {
      add_normal(half_space_.nu, r, weight_.data(), count, terms_.data());
    } else {
      add_terms(half_space_.nu, place_.data(), along_first, along_other, r, weight_.data(), count, terms_.data());
    }
  }
  return terms_;
}

}  // namespace touchstone::fem
