#include "sensors/colour/hue_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

/// Solves normal equations of which the lower half is given. The ridge is on terms of unit mean square: it treats those
/// of high degree, whose values spread most, like others.
Eigen::MatrixXd solve_ridge(Eigen::MatrixXd normal, const Eigen::MatrixXd& right, double ridge, std::size_t rows) {
  const double least = 1e-12 * static_cast<double>(rows);
  normal.triangularView<Eigen::StrictlyUpper>() = normal.transpose();
  const Eigen::VectorXd diagonal = normal.diagonal().cwiseMax(least);
  normal.diagonal() += ridge * diagonal;
  normal.diagonal().array() += least;
  return normal.ldlt().solve(right);
}

/// 1 for the scalars of IsotropicFeatures that are a shift's square, else 0.
Eigen::VectorXd shift_flags(const HueFeatures& features) {
  std::vector<double> flags;
  if (features.hue) flags.push_back(0.0);
  if (features.centroid) flags.push_back(1.0);
  if (features.ink_centroid) flags.push_back(1.0);
  if (features.coloured_area) flags.push_back(0.0);
  if (features.ink_area) flags.push_back(0.0);
  if (features.cell_area) flags.push_back(0.0);
  if (features.neighbour_area) flags.push_back(0.0);
  return Eigen::Map<const Eigen::VectorXd>(flags.data(), static_cast<Eigen::Index>(flags.size()));
}

}  // namespace

HueLine fit_line(const std::vector<HueRow>& rows, const HueModelForm& form) {
  Eigen::Matrix2d hue_normal = Eigen::Matrix2d::Zero(), gain_normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d hue_right = Eigen::Vector2d::Zero(), gain_right = Eigen::Vector2d::Zero();
  for (const HueRow& row : rows) {
    const Eigen::Vector2d hue_terms(row.press, form.free_offset ? 1.0 : 0.0);
    hue_normal += hue_terms * hue_terms.transpose();
    hue_right += row.change.hue * hue_terms;
    const Eigen::Vector2d& shift = form.of_ink ? row.change.ink_centroid_mm : row.change.centroid_mm;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d gain_terms(row.press * row.lateral[axis], row.lateral[axis]);
      gain_normal += gain_terms * gain_terms.transpose();
      gain_right += shift[axis] * gain_terms;
    }
  }
  if (!form.free_offset) hue_normal(1, 1) = 1.0;
  const auto is_singular = [](const Eigen::Matrix2d& m) {
    return !(m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0) > 1e-9 * m(0, 0) * m(1, 1));
  };
  if (!(hue_normal(0, 0) > 0.0) || is_singular(hue_normal))
    fail("hue calibration: the samples have no press to fit to");
  HueLine line;
  line.of_ink = form.of_ink;
  const Eigen::Vector2d hue = hue_normal.ldlt().solve(hue_right);
  line.hue_slope = hue[0];
  line.hue_offset = form.free_offset ? hue[1] : 0.0;
  if (!(gain_normal(1, 1) > 0.0)) fail("hue calibration: the samples have no lateral displacement to fit to");
  if (is_singular(gain_normal)) {
    line.gain = gain_right[1] / gain_normal(1, 1);  // all at one depth
  } else {
    const Eigen::Vector2d gain = gain_normal.ldlt().solve(gain_right);
    line.gain_slope = gain[0];
    line.gain = gain[1];
  }
  return line;
}

HuePolynomial fit_polynomial(const std::vector<HueRow>& rows, const HueModelForm& form) {
  HuePolynomial polynomial;
  polynomial.features = form.features;
  polynomial.degree = form.degree;
  const std::vector<int> places = form.features.indices();
  const auto features = static_cast<Eigen::Index>(places.size());
  Eigen::VectorXd square = Eigen::VectorXd::Zero(features);
  for (const HueRow& row : rows) {
    for (Eigen::Index j = 0; j < features; ++j) {
      square[j] +=
          std::pow(row.change.vector()[places[static_cast<std::size_t>(j)]], 2) / static_cast<double>(rows.size());
    }
  }
  polynomial.scale = square.cwiseSqrt().cwiseMax(1e-9);
  const Eigen::MatrixXi terms = hue_terms(static_cast<int>(features), form.degree);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms.rows(), terms.rows());
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(terms.rows(), 3);
  Eigen::VectorXd scaled(features);
  for (const HueRow& row : rows) {
    const Eigen::Matrix<double, MarkerChange::kSize, 1> all = row.change.vector();
    for (Eigen::Index j = 0; j < features; ++j) {
      scaled[j] = all[places[static_cast<std::size_t>(j)]] / polynomial.scale[j];
    }
    const Eigen::VectorXd values = hue_term_values(terms, scaled);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(values);
    right += values * Eigen::RowVector3d(row.lateral.x(), row.lateral.y(), row.press);
  }
  polynomial.coefficients = solve_ridge(normal, right, form.ridge, rows.size());
  return polynomial;
}

HueIsotropic fit_isotropic(const std::vector<HueRow>& rows, const HueModelForm& form) {
  HueIsotropic isotropic;
  isotropic.features = form.features;
  isotropic.degree = form.degree;
  const int scalars = IsotropicFeatures::count(form.features);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(scalars);
  // A shift's scalar is its square already.
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(scalars);
  const Eigen::VectorXd is_shift = shift_flags(form.features);
  for (const HueRow& row : rows) {
    const IsotropicFeatures unscaled(form.features, ones, row.change);
    mean += (is_shift.array() > 0.0).select(unscaled.scalars, unscaled.scalars.cwiseAbs2());
  }
  isotropic.scale = (mean / static_cast<double>(rows.size())).cwiseSqrt().cwiseMax(1e-9);
  const Eigen::MatrixXi terms = hue_terms(scalars, form.degree);
  const Eigen::Index each = 1 + count_lower_terms(scalars, form.degree);
  const Eigen::Index lateral = each * static_cast<Eigen::Index>(std::lround(is_shift.sum()));
  Eigen::MatrixXd press_normal = Eigen::MatrixXd::Zero(terms.rows(), terms.rows());
  Eigen::MatrixXd lateral_normal = Eigen::MatrixXd::Zero(lateral, lateral);
  Eigen::VectorXd press_right = Eigen::VectorXd::Zero(terms.rows());
  Eigen::VectorXd lateral_right = Eigen::VectorXd::Zero(lateral);
  Eigen::VectorXd basis(lateral);
  for (const HueRow& row : rows) {
    const IsotropicFeatures features(form.features, isotropic.scale, row.change);
    const Eigen::VectorXd values = hue_term_values(terms, features.scalars);
    press_normal.selfadjointView<Eigen::Lower>().rankUpdate(values);
    press_right += row.press * values;
    for (int axis = 0; axis < 2; ++axis) {
      for (std::size_t i = 0; i < features.shifts.size(); ++i) {
        auto part = basis.segment(static_cast<Eigen::Index>(i) * each, each);
        part[0] = 1.0;
        part.tail(each - 1) = values.head(each - 1);
        part *= features.shifts[i][axis];
      }
      lateral_normal.selfadjointView<Eigen::Lower>().rankUpdate(basis);
      lateral_right += row.lateral[axis] * basis;
    }
  }
  isotropic.press = solve_ridge(press_normal, press_right, form.ridge, rows.size());
  isotropic.lateral = solve_ridge(lateral_normal, lateral_right, form.ridge, rows.size());
  return isotropic;
}

HueRange fit_range(const std::vector<HueRow>& rows) {
  HueRange range;
  Eigen::Matrix<double, MarkerChange::kSize, MarkerChange::kSize> square = range.precision;
  for (const HueRow& row : rows) {
    range.lowest_hue = std::min(range.lowest_hue, row.change.hue);
    range.highest_hue = std::max(range.highest_hue, row.change.hue);
    range.largest_shift_mm = std::max(range.largest_shift_mm, row.change.centroid_mm.norm());
    range.largest_ink_shift_mm = std::max(range.largest_ink_shift_mm, row.change.ink_centroid_mm.norm());
    const Eigen::Matrix<double, MarkerChange::kSize, 1> all = row.change.vector();
    square += all * all.transpose() / static_cast<double>(rows.size());
  }
  // A direction that calibration hardly saw isn't forbidden outright: noise of a hundredth is let through.
  Eigen::Matrix<double, MarkerChange::kSize, 1> floor;
  floor.setConstant(0.01);
  square.diagonal() += floor.cwiseAbs2();
  range.precision = square.ldlt().solve(decltype(square)::Identity().eval());
  for (const HueRow& row : rows) {
    const Eigen::Matrix<double, MarkerChange::kSize, 1> all = row.change.vector();
    range.largest_distance = std::max(range.largest_distance, all.dot(range.precision * all));
  }
  return range;
}

}  // namespace touchstone::sensors
