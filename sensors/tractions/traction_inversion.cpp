#include "sensors/tractions/traction_inversion.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/dense_solvers.h"
#include "core/error.h"
#include "sensors/numerics/nonnegative_minimum.h"

namespace touchstone::sensors {
namespace {

/// Parts of the first pressure's maximum above which a patch may be in contact. Falling: each contact is part of the
/// next.
constexpr std::array kLevels = {0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05, 0.0};
// So many contacts in a row of less evidence than the best: the larger ones have less still.
constexpr std::size_t kWorse = 2;
constexpr std::size_t kWorseThanNone = 4;

void check(double value, double low, double high, const char* name) {
  if (!(value >= low && value <= high)) fail("{} is {}, it must be from {} to {}", name, value, low, high);
}

/// Length of what two intervals share.
double overlap(double low_a, double high_a, double low_b, double high_b) {
  return std::max(0.0, std::min(high_a, high_b) - std::max(low_a, low_b));
}

/// Between neighbouring markers, mm; of a single one two patches.
double marker_spacing(const MarkerCompliance& c) {
  double sum = 0.0;
  int count = 0;
  const int nx = c.marker_grid.x();
  const auto gap = [&](int a, int b) {
    sum += (c.marker_rest[static_cast<std::size_t>(a)] - c.marker_rest[static_cast<std::size_t>(b)]).head<2>().norm();
    ++count;
  };
  for (int m = 0; m < c.markers(); ++m) {
    if (m % nx + 1 < nx) gap(m, m + 1);
    if (m + nx < c.markers()) gap(m, m + nx);
  }
  return count > 0 ? sum / count : 2.0 * c.patch_side;
}

Eigen::MatrixXd shares_of_patches(const MarkerCompliance& c) {
  const double half = 0.5 * marker_spacing(c);
  const double side = 0.5 * c.patch_side;
  Eigen::MatrixXd share(c.markers(), c.patches());
  for (int m = 0; m < c.markers(); ++m) {
    const Eigen::Vector3d& at = c.marker_rest[static_cast<std::size_t>(m)];
    for (int p = 0; p < c.patches(); ++p) {
      const Eigen::Vector2d q = c.patch_centre(p);
      share(m, p) = overlap(at.x() - half, at.x() + half, q.x() - side, q.x() + side) *
                    overlap(at.y() - half, at.y() + half, q.y() - side, q.y() + side) / (4.0 * half * half);
    }
  }
  return share;
}

/// The unknowns of these patches.
std::vector<int> unknowns(const std::vector<int>& patches) {
  std::vector<int> rows;
  for (const int p : patches) {
    for (int a = 0; a < 3; ++a) rows.push_back(3 * p + a);
  }
  return rows;
}

/// From the unknowns of these patches to the wrench on the object: 6 x 3 patches. The object is pushed by the gel, so
/// along z by the pressure, along x and y against the traction on the gel.
Eigen::MatrixXd wrench_of(const MarkerCompliance& c, const std::vector<int>& patches) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(6, 3 * static_cast<Eigen::Index>(patches.size()));
  const Eigen::Vector3d sign = c.patch_area() * Eigen::Vector3d(-1.0, -1.0, 1.0);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const Eigen::Vector2d at = c.patch_centre(patches[k]);
    for (int a = 0; a < 3; ++a) {
      const Eigen::Index column = 3 * static_cast<Eigen::Index>(k) + a;
      const Eigen::Vector3d force = sign[a] * Eigen::Vector3d::Unit(a);
      result.col(column).head<3>() = force;
      result.col(column).tail<3>() = Eigen::Vector3d(at.x(), at.y(), 0.0).cross(force);
    }
  }
  return result;
}

}  // namespace

/// The tractions if just these patches touch.
struct TractionInversion::Candidate {
  std::vector<int> patches;
  Eigen::VectorXd x;  ///< 3 patches
  /// Of the information on all of them. Made of something, since a fresh LLT has indeterminate members to copy.
  Eigen::LLT<Eigen::MatrixXd> factor{Eigen::MatrixXd(Eigen::MatrixXd::Identity(1, 1))};
  Vector6d wrench = Vector6d::Zero();
  double misfit_square = 0.0;  ///< sum over the measured displacements, over the noise
  double score = 0.0;          ///< -2 log evidence, but for a constant
  int factorisations = 0;
};

double TractionField::sigma(int component) const {
  TS_ASSERT(component >= 0 && component < 6);
  return std::sqrt(std::max(0.0, uncertainty(component, component)));
}

TractionInversion::TractionInversion(MarkerCompliance compliance, const TractionSettings& settings)
    : compliance_(std::move(compliance)), settings_(settings) {
  const std::string fault = fault_of(compliance_);
  if (!fault.empty()) fail("marker compliance: {}", fault);
  if (compliance_.patches() > kMostInverted) {
    fail("the marker compliance has {} patches; at most {} are inverted", compliance_.patches(), kMostInverted);
  }
  constexpr double kLeastNoise = 1e-6, kMostNoise = 10.0;
  check(settings_.lateral_noise_mm, kLeastNoise, kMostNoise, "lateral_noise_mm");
  check(settings_.normal_noise_mm, kLeastNoise, kMostNoise, "normal_noise_mm");
  check(settings_.correlation, 0.05, 5.0, "correlation");
  check(settings_.scale, 0.001, 100.0, "scale");
  check(settings_.first_scale, 0.001, 100.0, "first_scale");

  const int patches = compliance_.patches();
  const double length = settings_.correlation * compliance_.thickness;
  correlation_.resize(patches, patches);
  for (int i = 0; i < patches; ++i) {
    for (int j = 0; j < patches; ++j) {
      const double r = (compliance_.patch_centre(i) - compliance_.patch_centre(j)).norm() / length;
      correlation_(i, j) = (1.0 + r) * std::exp(-r);
    }
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(correlation_);
  if (factor.info() != Eigen::Success) {
    fail("correlation is {}: so smooth that tractions on patches of {} mm can't be separated", settings_.correlation,
         compliance_.patch_side);
  }
  inverse_correlation_ = factor.solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(patches, patches)));
  share_ = shares_of_patches(compliance_);

  all_weighted_ = compliance_.displacement;
  for (Eigen::Index row = 0; row < all_weighted_.rows(); ++row) {
    all_weighted_.row(row) /= row % 3 == 2 ? settings_.normal_noise_mm : settings_.lateral_noise_mm;
  }
  for (int p = 0; p < patches; ++p) all_weighted_.col(3 * p + 2) *= -1.0;  // pressure
  all_normal_.setZero(3 * patches, 3 * patches);
  all_normal_.selfadjointView<Eigen::Lower>().rankUpdate(all_weighted_.transpose());
  all_normal_.triangularView<Eigen::StrictlyUpper>() = all_normal_.transpose();
  const double scale = settings_.first_scale * compliance_.youngs_modulus;
  all_lateral_.setZero(all_weighted_.rows(), all_weighted_.rows());
  for (int a = 0; a < 2; ++a) {
    const Eigen::MatrixXd along = all_weighted_(Eigen::all, Eigen::seqN(a, patches, 3));
    all_lateral_ += scale * scale * along * correlation_ * along.transpose();
  }
}

void TractionInversion::prepare(const std::vector<std::uint8_t>& measured) {
  const int patches = compliance_.patches();
  weighted_ = all_weighted_;
  normal_ = all_normal_;
  Eigen::MatrixXd spread = all_lateral_;  // what lateral tractions and noise do to the data, over the noise
  std::vector<Eigen::Index> missing;
  for (std::size_t m = 0; m < measured.size(); ++m) {
    for (Eigen::Index row = 3 * static_cast<Eigen::Index>(m);
         !measured[m] && row < 3 * static_cast<Eigen::Index>(m) + 3; ++row) {
      missing.push_back(row);
      weighted_.row(row).setZero();
      spread.row(row).setZero();
      spread.col(row).setZero();
    }
  }
  if (!missing.empty()) {
    const Eigen::MatrixXd taken_off = all_weighted_(missing, Eigen::all);
    normal_.selfadjointView<Eigen::Lower>().rankUpdate(taken_off.transpose(), -1.0);
    normal_.triangularView<Eigen::StrictlyUpper>() = normal_.transpose();
  }
  spread.diagonal().array() += 1.0;
  const Eigen::MatrixXd of_pressure = weighted_(Eigen::all, Eigen::seqN(2, patches, 3));
  first_load_ = Eigen::LLT<Eigen::MatrixXd>(spread).solve(of_pressure).transpose();
  const double scale = settings_.first_scale * compliance_.youngs_modulus;
  first_normal_ = first_load_ * of_pressure;
  first_normal_ = (0.5 * (first_normal_ + first_normal_.transpose()) + inverse_correlation_ / (scale * scale)).eval();
  first_factor_.compute(first_normal_);
  measured_ = measured;
}

std::vector<std::vector<int>> TractionInversion::possible_contacts(const Eigen::VectorXd& data,
                                                                   int& factorisations) const {
  const int patches = compliance_.patches();
  const Eigen::VectorXd vertical = first_load_ * data;
  const NonnegativeMinimum first = nonnegative_minimum(first_normal_, first_factor_, vertical,
                                                       std::vector<std::uint8_t>(static_cast<std::size_t>(patches), 1));
  factorisations += first.factorisations;
  std::vector<std::vector<int>> result = {{}};  // nothing touches
  const double largest = first.x.maxCoeff();
  for (const double level : kLevels) {
    std::vector<int> contact;
    for (int p = 0; p < patches; ++p) {
      if (first.x[p] > level * largest) contact.push_back(p);
    }
    if (contact != result.back()) result.push_back(std::move(contact));
  }
  if (result.size() == 1) {  // all pulls: to know how little is known there has to be something to compare with
    result.emplace_back();
    for (int p = 0; p < patches; ++p) result.back().push_back(p);
  }
  return result;
}

TractionInversion::Candidate TractionInversion::solve(const std::vector<int>& patches, const Eigen::VectorXd& load,
                                                      double data_square) const {
  Candidate result;
  result.patches = patches;
  result.misfit_square = result.score = data_square;
  if (patches.empty()) return result;
  const std::vector<int> rows = unknowns(patches);
  const Eigen::LLT<Eigen::MatrixXd> correlation(Eigen::MatrixXd(correlation_(patches, patches)));
  TS_ASSERT(correlation.info() == Eigen::Success);
  const auto count = static_cast<Eigen::Index>(patches.size());
  const double scale = settings_.scale * compliance_.youngs_modulus;
  const Eigen::MatrixXd stiff =
      correlation.solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(count, count))) / (scale * scale);
  const Eigen::MatrixXd normal = normal_(rows, rows);
  Eigen::MatrixXd information = normal;
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      for (Eigen::Index a = 0; a < 3; ++a) information(3 * i + a, 3 * j + a) += stiff(i, j);
    }
  }
  std::vector<std::uint8_t> sign(rows.size(), 0);
  for (std::size_t k = 2; k < sign.size(); k += 3) sign[k] = 1;
  const Eigen::VectorXd b = load(rows);
  result.factor.compute(information);
  const NonnegativeMinimum minimum = nonnegative_minimum(information, result.factor, b, sign);
  result.x = minimum.x;
  result.factorisations = 1 + minimum.factorisations;

  const Eigen::VectorXd seen = normal * result.x;
  result.misfit_square = data_square - 2.0 * b.dot(result.x) + result.x.dot(seen);
  const double cost = result.x.dot(information * result.x) - result.x.dot(seen);
  const double log_information = 2.0 * result.factor.matrixLLT().diagonal().array().log().sum();
  const double log_prior = 3.0 * (2.0 * correlation.matrixLLT().diagonal().array().log().sum() +
                                  2.0 * static_cast<double>(count) * std::log(scale));
  result.score = result.misfit_square + cost + log_information + log_prior;
  result.wrench = wrench_of(compliance_, patches) * result.x;
  return result;
}

TractionField TractionInversion::invert(const MarkerField& field) {
  const auto markers = static_cast<std::size_t>(compliance_.markers());
  if (field.grid != compliance_.marker_grid) {
    fail("the field has {} x {} markers, the marker compliance is of {} x {}", field.grid.x(), field.grid.y(),
         compliance_.marker_grid.x(), compliance_.marker_grid.y());
  }
  if (field.displacement.size() != markers || field.measured.size() != markers) {
    fail("the field has {} displacements and {} marks of what is measured, {} are needed", field.displacement.size(),
         field.measured.size(), markers);
  }
  TractionField result;
  std::vector<std::uint8_t> measured(markers);
  Eigen::VectorXd data = Eigen::VectorXd::Zero(3 * compliance_.markers());
  for (std::size_t m = 0; m < markers; ++m) {
    if (field.measured[m] == 0) continue;
    if (!field.displacement[m].allFinite()) fail("the displacement of marker {} isn't finite", m);
    measured[m] = 1;
    ++result.measured;
    data.segment<3>(3 * static_cast<Eigen::Index>(m)) = field.displacement[m].cwiseQuotient(
        Eigen::Vector3d(settings_.lateral_noise_mm, settings_.lateral_noise_mm, settings_.normal_noise_mm));
  }
  if (result.measured < kLeastMarkers) {
    fail("{} markers are measured, at least {} are needed", result.measured, kLeastMarkers);
  }
  if (measured != measured_) prepare(measured);

  const Eigen::VectorXd load = weighted_.transpose() * data;
  const double data_square = data.squaredNorm();
  std::vector<Candidate> tried;
  std::size_t best = 0;
  for (const std::vector<int>& contact : possible_contacts(data, result.factorisations)) {
    tried.push_back(solve(contact, load, data_square));
    result.factorisations += tried.back().factorisations;
    if (tried.back().score < tried[best].score) best = tried.size() - 1;
    if (tried.size() > best + (best > 0 ? kWorse : kWorseThanNone)) break;
  }
  describe(tried, best, result);
  if (result.in_contact) carry(field, result);
  return result;
}

void TractionInversion::carry(const MarkerField& field, TractionField& result) const {
  double pressure = 0.0;
  for (int p = 0; p < compliance_.patches(); ++p) {
    result.centre_of_pressure -= result.traction(2, p) * compliance_.patch_centre(p);
    pressure -= result.traction(2, p);
  }
  if (pressure > 0.0) result.centre_of_pressure /= pressure;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double weight = 0.0;
  for (std::size_t m = 0; m < field.displacement.size(); ++m) {
    if (!field.measured[m]) continue;
    const double of = -result.markers[m].traction.z();
    mean += of * field.displacement[m];
    weight += of;
  }
  if (weight > 0.0) result.wrench.tail<3>() += (mean / weight).cross(Eigen::Vector3d(result.wrench.head<3>()));
}

void TractionInversion::describe(const std::vector<Candidate>& tried, std::size_t best, TractionField& result) const {
  const Candidate& chosen = tried[best];
  result.contacts_tried = static_cast<int>(tried.size());
  result.in_contact = !chosen.patches.empty();
  result.traction.setZero(3, compliance_.patches());
  result.contact.assign(static_cast<std::size_t>(compliance_.patches()), 0);
  result.markers.assign(static_cast<std::size_t>(compliance_.markers()), {});
  result.wrench = chosen.wrench;
  double weights = 0.0;
  for (const Candidate& other : tried) {
    const double weight = std::exp(-0.5 * (other.score - chosen.score));
    const Vector6d apart = other.wrench - chosen.wrench;
    weights += weight;
    result.uncertainty += weight * apart * apart.transpose();
  }
  result.uncertainty /= weights;
  if (!result.in_contact && tried.size() > 1) {
    // A touch too light to be sure of: whatever the likeliest contact would have been may be missed.
    const auto likeliest = std::min_element(tried.begin() + 1, tried.end(),
                                            [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
    result.uncertainty += likeliest->wrench * likeliest->wrench.transpose();
  }
  const double values = 3.0 * result.measured;
  double used = 0.0;
  std::vector<int> rows;
  if (result.in_contact) {
    rows = unknowns(chosen.patches);
    const Eigen::MatrixXd normal = normal_(rows, rows);
    used = chosen.factor.solve(normal).trace();
    const Eigen::MatrixXd answer =
        chosen.factor.solve(Eigen::MatrixXd(wrench_of(compliance_, chosen.patches).transpose()));
    result.noise = answer.transpose() * normal * answer;
  }
  result.misfit = std::sqrt(std::max(0.0, chosen.misfit_square) / std::max(1.0, values - used));
  const double widen = std::max(1.0, result.misfit * result.misfit);
  const Candidate& larger = tried[std::min(best + 1, tried.size() - 1)];
  if (!larger.patches.empty()) {
    Eigen::MatrixXd spread = wrench_of(compliance_, larger.patches).transpose();
    larger.factor.matrixL().solveInPlace(spread);
    result.uncertainty += widen * spread.transpose() * spread;
  }
  if (!result.in_contact) return;
  for (std::size_t k = 0; k < chosen.patches.size(); ++k) {
    const Eigen::Vector3d x = chosen.x.segment<3>(3 * static_cast<Eigen::Index>(k));
    result.traction.col(chosen.patches[k]) = Eigen::Vector3d(x.x(), x.y(), -x.z());
    result.contact[static_cast<std::size_t>(chosen.patches[k])] = 1;
  }
  for (int m = 0; m < compliance_.markers(); ++m) {
    MarkerTraction& marker = result.markers[static_cast<std::size_t>(m)];
    const Eigen::VectorXd share = share_.row(m)(chosen.patches);
    marker.contact = share.sum();
    if (marker.contact <= 0.0) continue;
    marker.traction = result.traction(Eigen::all, chosen.patches) * share;
    Eigen::MatrixXd pick = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), 3);
    for (Eigen::Index k = 0; k < share.size(); ++k) {
      pick.middleRows<3>(3 * k).diagonal() = share[k] * Eigen::Vector3d(1.0, 1.0, -1.0);
    }
    chosen.factor.matrixL().solveInPlace(pick);
    marker.covariance = widen * pick.transpose() * pick;
  }
}

}  // namespace touchstone::sensors
