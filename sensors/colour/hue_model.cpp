#include "sensors/colour/hue_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

constexpr int kMostDegree = 4;
constexpr double kLeastGain = 0.02;  ///< a shift of the centroid by a fiftieth of the displacement says nothing of it
constexpr double kBeyond = 0.05;     ///< of what was seen

void add_terms(int feature, int left, Eigen::RowVectorXi& exponents, std::vector<Eigen::RowVectorXi>& rows) {
  if (feature + 1 == exponents.size()) {
    exponents[feature] = left;
    rows.push_back(exponents);
    return;
  }
  for (int here = left; here >= 0; --here) {
    exponents[feature] = here;
    add_terms(feature + 1, left - here, exponents, rows);
  }
}

std::string fault_of_terms(int degree, const Eigen::VectorXd& scale, int features) {
  if (features == 0) return "it is of no feature";
  if (degree < 1 || degree > kMostDegree) {
    return fmt::format("its degree is {}, it must be from 1 to {}", degree, kMostDegree);
  }
  if (scale.size() != features || !scale.allFinite() || scale.minCoeff() <= 0.0) {
    return "its features' scales aren't all above zero";
  }
  return "";
}

}  // namespace

const char* name_of(HueForm form) {
  switch (form) {
    case HueForm::kEquation4:
      return "equation_4";
    case HueForm::kIsotropic:
      return "isotropic";
    case HueForm::kPolynomial:
      return "polynomial";
  }
  return "?";
}

std::vector<int> HueFeatures::indices() const {
  std::vector<int> places;
  if (hue) places.push_back(0);
  if (centroid) places.insert(places.end(), {1, 2});
  if (ink_centroid) places.insert(places.end(), {3, 4});
  if (coloured_area) places.push_back(5);
  if (ink_area) places.push_back(6);
  if (cell_area) places.push_back(7);
  if (neighbour_area) places.push_back(8);
  return places;
}

Eigen::MatrixXi hue_terms(int features, int degree) {
  TS_ASSERT(features >= 1 && features <= MarkerChange::kSize && degree >= 1 && degree <= kMostDegree);
  std::vector<Eigen::RowVectorXi> rows;
  Eigen::RowVectorXi exponents(features);
  for (int total = 1; total <= degree; ++total) add_terms(0, total, exponents, rows);
  Eigen::MatrixXi terms(static_cast<Eigen::Index>(rows.size()), features);
  for (std::size_t i = 0; i < rows.size(); ++i) terms.row(static_cast<Eigen::Index>(i)) = rows[i];
  return terms;
}

Eigen::VectorXd hue_term_values(const Eigen::MatrixXi& terms, const Eigen::VectorXd& scaled) {
  TS_ASSERT(terms.cols() == scaled.size());
  Eigen::VectorXd values(terms.rows());
  for (Eigen::Index i = 0; i < terms.rows(); ++i) {
    double product = 1.0;
    for (Eigen::Index j = 0; j < terms.cols(); ++j) {
      for (int power = terms(i, j); power > 0; --power) product *= scaled[j];
    }
    values[i] = product;
  }
  return values;
}

std::string fault_of(const HueModel& model) {
  const auto is_positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  if (!is_positive(model.spacing_mm)) return fmt::format("its spacing is {} mm", model.spacing_mm);
  const double distance = model.parallax.viewing_distance_mm;
  if (distance != 0.0 && !(distance >= 10.0 && std::isfinite(distance))) {
    return fmt::format("its viewing distance is {} mm, it must be 0 or at least 10", distance);
  }
  if (!model.parallax.axis_mm.allFinite()) return "its view's axis isn't finite";
  const HueLine& line = model.line;
  const HuePolynomial& polynomial = model.polynomial;
  if (model.form == HueForm::kEquation4) {
    if (!(std::abs(line.hue_slope) > 0.0) || !std::isfinite(line.hue_slope)) {
      return fmt::format("its hue slope is {} rad/mm", line.hue_slope);
    }
    if (!std::isfinite(line.hue_offset) || !std::isfinite(line.gain) || !std::isfinite(line.gain_slope)) {
      return "its line isn't finite";
    }
  } else if (model.form == HueForm::kIsotropic) {
    const HueIsotropic& isotropic = model.isotropic;
    const int centroids = isotropic.features.centroid + isotropic.features.ink_centroid;
    if (centroids == 0) return "it is of no centroid";
    const int scalars = IsotropicFeatures::count(isotropic.features);
    const std::string fault = fault_of_terms(isotropic.degree, isotropic.scale, scalars);
    if (!fault.empty()) return fault;
    const Eigen::Index lateral = centroids * (1 + count_lower_terms(scalars, isotropic.degree));
    if (isotropic.press.size() != hue_terms(scalars, isotropic.degree).rows() || isotropic.lateral.size() != lateral) {
      return fmt::format("it has {} and {} coefficients, {} and {} terms", isotropic.press.size(),
                         isotropic.lateral.size(), hue_terms(scalars, isotropic.degree).rows(), lateral);
    }
    if (!isotropic.press.allFinite() || !isotropic.lateral.allFinite()) return "a coefficient isn't finite";
  } else {
    const auto features = static_cast<int>(polynomial.features.indices().size());
    const std::string fault = fault_of_terms(polynomial.degree, polynomial.scale, features);
    if (!fault.empty()) return fault;
    if (polynomial.coefficients.rows() != hue_terms(features, polynomial.degree).rows()) {
      return fmt::format("it has {} coefficients, {} terms", polynomial.coefficients.rows(),
                         hue_terms(features, polynomial.degree).rows());
    }
    if (!polynomial.coefficients.allFinite()) return "a coefficient isn't finite";
  }
  for (const MarkerGain& gain : model.gains) {
    if (gain.marker < 0 || !is_positive(gain.lateral) || !is_positive(gain.press)) {
      return fmt::format("marker {}'s gains are {} and {}", gain.marker, gain.lateral, gain.press);
    }
  }
  return "";
}

int IsotropicFeatures::count(const HueFeatures& features) {
  return features.hue + features.centroid + features.ink_centroid + features.coloured_area + features.ink_area +
         features.cell_area + features.neighbour_area;
}

IsotropicFeatures::IsotropicFeatures(const HueFeatures& features, const Eigen::VectorXd& scale,
                                     const MarkerChange& change)
    : scalars(count(features)) {
  TS_ASSERT(scale.size() == scalars.size());
  Eigen::Index i = 0;
  const auto add_scalar = [&](bool is_used, double value) {
    if (!is_used) return;
    scalars[i] = value / scale[i];
    ++i;
  };
  const auto add_shift = [&](bool is_used, const Eigen::Vector2d& value) {
    if (!is_used) return;
    shifts.emplace_back(value / scale[i]);
    scalars[i++] = shifts.back().squaredNorm();
  };
  add_scalar(features.hue, change.hue);
  add_shift(features.centroid, change.centroid_mm);
  add_shift(features.ink_centroid, change.ink_centroid_mm);
  add_scalar(features.coloured_area, change.log_coloured_area);
  add_scalar(features.ink_area, change.log_ink_area);
  add_scalar(features.cell_area, change.log_cell_area);
  add_scalar(features.neighbour_area, change.log_neighbour_area);
}

Eigen::Index count_lower_terms(int features, int degree) {
  return degree > 1 ? hue_terms(features, degree - 1).rows() : 0;
}

HueFeatures features_of(const HueModel& model) {
  switch (model.form) {
    case HueForm::kIsotropic:
      return model.isotropic.features;
    case HueForm::kPolynomial:
      return model.polynomial.features;
    case HueForm::kEquation4:
      break;
  }
  return {false, false, false, false, false, false, false};
}

std::string summary_of(const HueModel& model) {
  if (model.form == HueForm::kEquation4) return "eq. 4";
  const bool isotropic = model.form == HueForm::kIsotropic;
  return fmt::format("an {} polynomial of degree {} of {}", isotropic ? "isotropic" : "unrestricted",
                     isotropic ? model.isotropic.degree : model.polynomial.degree,
                     features_of(model).of_surroundings() ? "the marker and its neighbours" : "the marker alone");
}

Eigen::MatrixXi terms_of(const HueModel& model) {
  if (model.form == HueForm::kEquation4) return {};
  if (model.form == HueForm::kIsotropic) {
    return hue_terms(IsotropicFeatures::count(model.isotropic.features), model.isotropic.degree);
  }
  return hue_terms(static_cast<int>(model.polynomial.features.indices().size()), model.polynomial.degree);
}

SeenDisplacement displacement_of(const HueModel& model, const Eigen::MatrixXi& terms, const MarkerChange& change) {
  SeenDisplacement out;
  if (features_of(model).of_surroundings() && !change.surroundings_known) {
    out.determined = false;
    return out;
  }
  if (model.form == HueForm::kEquation4) {
    const HueLine& line = model.line;
    out.press_mm = (change.hue - line.hue_offset) / line.hue_slope;
    const double gain = line.gain_slope * out.press_mm + line.gain;
    out.determined = std::abs(gain) >= kLeastGain;
    if (out.determined) out.lateral_mm = (line.of_ink ? change.ink_centroid_mm : change.centroid_mm) / gain;
    return out;
  }
  if (model.form == HueForm::kIsotropic) {
    const HueIsotropic& isotropic = model.isotropic;
    const IsotropicFeatures features(isotropic.features, isotropic.scale, change);
    const Eigen::VectorXd values = hue_term_values(terms, features.scalars);
    out.press_mm = values.dot(isotropic.press);
    const auto centroids = static_cast<Eigen::Index>(features.shifts.size());
    const Eigen::Index each = isotropic.lateral.size() / centroids;
    for (Eigen::Index i = 0; i < centroids; ++i) {
      const auto coefficients = isotropic.lateral.segment(i * each, each);
      const double gain = coefficients[0] + coefficients.tail(each - 1).dot(values.head(each - 1));
      out.lateral_mm += gain * features.shifts[static_cast<std::size_t>(i)];
    }
    return out;
  }
  const HuePolynomial& polynomial = model.polynomial;
  const Eigen::Matrix<double, MarkerChange::kSize, 1> all = change.vector();
  Eigen::VectorXd scaled(polynomial.scale.size());
  Eigen::Index i = 0;
  for (const int place : polynomial.features.indices()) {
    scaled[i] = all[place] / polynomial.scale[i];
    ++i;
  }
  const Eigen::RowVector3d sum = hue_term_values(terms, scaled).transpose() * polynomial.coefficients;
  out.lateral_mm = sum.head<2>().transpose();
  out.press_mm = sum.z();
  return out;
}

bool is_beyond(const HueRange& range, const MarkerChange& change) {
  const double slack = kBeyond * (range.highest_hue - range.lowest_hue);
  if (change.hue < range.lowest_hue - slack || change.hue > range.highest_hue + slack) return true;
  if (change.centroid_mm.norm() > (1.0 + kBeyond) * range.largest_shift_mm) return true;
  if (change.ink_centroid_mm.norm() > (1.0 + kBeyond) * range.largest_ink_shift_mm) return true;
  const Eigen::Matrix<double, MarkerChange::kSize, 1> all = change.vector();
  return all.dot(range.precision * all) > (1.0 + kBeyond) * (1.0 + kBeyond) * range.largest_distance;
}

}  // namespace touchstone::sensors
