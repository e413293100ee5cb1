#include "sensors/hue_calibration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "core/error.h"
#include "sensors/hue_estimator.h"

namespace touchstone::sensors {

namespace {

/// A sample as the fits take it.
struct Row {
  std::size_t marker = 0;
  MarkerChange change;
  Eigen::Vector2d lateral = Eigen::Vector2d::Zero();  ///< as seen, mm
  double press = 0.0;
};

std::vector<Row> rows_of(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                         const HueCalibrationSettings& settings) {
  if (samples.size() < kLeastHueSamples) {
    fail("hue calibration: {} samples, at least {} are needed", samples.size(), kLeastHueSamples);
  }
  const PictureMap map = map_of_rest(rest, settings.spacing_mm);
  const std::vector<Eigen::Vector2d> places = grid_places(rest.grid, settings.spacing_mm);
  std::vector<Row> rows;
  rows.reserve(samples.size());
  for (const HueSample& sample : samples) {
    if (sample.marker >= rest.markers.size() || rest.markers[sample.marker].flaw != MarkerFlaw::kNone) {
      fail("hue calibration: marker {} isn't sound at rest", sample.marker);
    }
    if (sample.seen.flaw != MarkerFlaw::kNone) {
      fail("hue calibration: a sample of marker {} is flawed: {}", sample.marker, name_of(sample.seen.flaw));
    }
    if (!sample.displacement_mm.allFinite())
      fail("hue calibration: a displacement of marker {} isn't finite", sample.marker);
    rows.push_back({sample.marker, change_of(sample.seen, rest.markers[sample.marker], map),
                    settings.parallax.seen(sample.displacement_mm, places[sample.marker]),
                    -sample.displacement_mm.z()});
  }
  return rows;
}

HueLine fit_line(const std::vector<Row>& rows, const HueModelForm& form) {
  Eigen::Matrix2d hue_normal = Eigen::Matrix2d::Zero(), gain_normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d hue_right = Eigen::Vector2d::Zero(), gain_right = Eigen::Vector2d::Zero();
  for (const Row& row : rows) {
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

/// A change or displacement under the square's turns (by 0 to 3 quarters) and its mirroring.
Eigen::Vector2d turned(Eigen::Vector2d v, int symmetry) {
  for (int quarter = symmetry & 3; quarter > 0; --quarter) v = Eigen::Vector2d(-v.y(), v.x());
  if (symmetry & 4) v.x() = -v.x();
  return v;
}

Row turned(Row row, int symmetry) {
  row.change.centroid_mm = turned(row.change.centroid_mm, symmetry);
  row.change.ink_centroid_mm = turned(row.change.ink_centroid_mm, symmetry);
  row.lateral = turned(row.lateral, symmetry);
  return row;
}

HuePolynomial fit_polynomial(const std::vector<Row>& rows, const HueModelForm& form) {
  HuePolynomial polynomial;
  polynomial.features = form.features;
  polynomial.degree = form.degree;
  const std::vector<int> places = form.features.indices();
  const auto features = static_cast<Eigen::Index>(places.size());
  Eigen::VectorXd square = Eigen::VectorXd::Zero(features);
  for (const Row& row : rows) {
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
  for (const Row& row : rows) {
    const Eigen::Matrix<double, MarkerChange::kSize, 1> all = row.change.vector();
    for (Eigen::Index j = 0; j < features; ++j)
      scaled[j] = all[places[static_cast<std::size_t>(j)]] / polynomial.scale[j];
    const Eigen::VectorXd values = hue_term_values(terms, scaled);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(values);
    right += values * Eigen::RowVector3d(row.lateral.x(), row.lateral.y(), row.press);
  }
  normal = normal.selfadjointView<Eigen::Lower>();
  // The ridge is on terms of unit mean square: it treats those of high degree, whose values spread most, like others.
  const Eigen::VectorXd diagonal = normal.diagonal().cwiseMax(1e-12 * static_cast<double>(rows.size()));
  normal.diagonal() += form.ridge * diagonal;
  normal.diagonal().array() += 1e-12 * static_cast<double>(rows.size());
  polynomial.coefficients = normal.ldlt().solve(right);
  return polynomial;
}

HueRange range_of(const std::vector<Row>& rows) {
  HueRange range;
  Eigen::Matrix<double, MarkerChange::kSize, MarkerChange::kSize> square = range.precision;
  for (const Row& row : rows) {
    range.lowest_hue = std::min(range.lowest_hue, row.change.hue);
    range.highest_hue = std::max(range.highest_hue, row.change.hue);
    range.largest_shift_mm = std::max(range.largest_shift_mm, row.change.centroid_mm.norm());
    range.largest_ink_shift_mm = std::max(range.largest_ink_shift_mm, row.change.ink_centroid_mm.norm());
    const Eigen::Matrix<double, MarkerChange::kSize, 1> all = row.change.vector();
    square += all * all.transpose() / static_cast<double>(rows.size());
  }
  // A direction that calibration hardly saw isn't forbidden outright: noise of a hundredth is let through.
  Eigen::Matrix<double, MarkerChange::kSize, 1> floor;
  floor << 0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01;
  square.diagonal() += floor.cwiseAbs2();
  range.precision = square.ldlt().solve(decltype(square)::Identity().eval());
  for (const Row& row : rows) {
    const Eigen::Matrix<double, MarkerChange::kSize, 1> all = row.change.vector();
    range.largest_distance = std::max(range.largest_distance, all.dot(range.precision * all));
  }
  return range;
}

std::vector<MarkerGain> fit_gains(const HueModel& model, const std::vector<Row>& rows) {
  const Eigen::MatrixXi terms =
      model.form == HueForm::kPolynomial
          ? hue_terms(static_cast<int>(model.polynomial.features.indices().size()), model.polynomial.degree)
          : Eigen::MatrixXi();
  std::set<std::size_t> markers;
  for (const Row& row : rows) markers.insert(row.marker);
  std::vector<MarkerGain> gains;
  for (const std::size_t marker : markers) {
    int count = 0;
    double lateral_square = 0.0, lateral_product = 0.0, press_square = 0.0, press_product = 0.0;
    for (const Row& row : rows) {
      if (row.marker != marker) continue;
      const SeenDisplacement seen = displacement_of(model, terms, row.change);
      if (!seen.determined) continue;
      ++count;
      lateral_square += seen.lateral_mm.squaredNorm();
      lateral_product += seen.lateral_mm.dot(row.lateral);
      press_square += seen.press_mm * seen.press_mm;
      press_product += seen.press_mm * row.press;
    }
    if (count < kLeastOwnSamples) continue;
    MarkerGain gain{static_cast<std::int64_t>(marker)};
    if (lateral_product > 0.0) gain.lateral = lateral_product / lateral_square;
    if (press_product > 0.0) gain.press = press_product / press_square;
    gains.push_back(gain);
  }
  return gains;
}

void check(const HueModelForm& form) {
  if (form.form != HueForm::kPolynomial) return;
  if (form.degree < 1 || form.degree > 4)
    fail("hue calibration: the degree is {}, it must be from 1 to 4", form.degree);
  if (!(form.ridge > 0.0 && form.ridge <= 1.0))
    fail("hue calibration: the ridge is {}, it must be above 0 and up to 1", form.ridge);
  if (form.features.indices().empty()) fail("hue calibration: the polynomial is of no feature");
}

}  // namespace

HueModel calibrate_hue(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                       const HueCalibrationSettings& settings) {
  check(settings.form);
  std::vector<Row> rows = rows_of(rest, samples, settings);
  const auto count = rows.size();
  HueModel model;
  model.form = settings.form.form;
  model.spacing_mm = settings.spacing_mm;
  model.parallax = settings.parallax;
  const bool pressed = std::any_of(rows.begin(), rows.end(), [](const Row& row) { return row.press != 0.0; });
  const bool moved = std::any_of(rows.begin(), rows.end(), [](const Row& row) { return !row.lateral.isZero(0.0); });
  if (!pressed) fail("hue calibration: the samples have no press to fit to");
  if (!moved) fail("hue calibration: the samples have no lateral displacement to fit to");
  if (settings.form.form == HueForm::kEquation4) model.line = fit_line(rows, settings.form);
  if (settings.form.form == HueForm::kEquation4 || settings.form.symmetric) {
    rows.reserve(8 * count);
    for (int symmetry = 1; symmetry < 8; ++symmetry) {
      for (std::size_t i = 0; i < count; ++i) rows.push_back(turned(rows[i], symmetry));
    }
  }
  if (settings.form.form == HueForm::kPolynomial) model.polynomial = fit_polynomial(rows, settings.form);
  model.range = range_of(rows);
  rows.resize(count);
  if (settings.own_gains) model.gains = fit_gains(model, rows);
  model.samples = static_cast<std::int64_t>(count);
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("hue calibration: the samples don't determine the model: {}", fault);
  model.rms_error_mm = hue_errors(model, rest, samples).rms_mm();
  return model;
}

double HueErrors::rms_mm() const {
  return std::sqrt(2.0 * rms_lateral_mm * rms_lateral_mm + rms_press_mm * rms_press_mm);
}

namespace {

struct ErrorSums {
  std::size_t count = 0;
  double lateral = 0.0, press = 0.0, largest = 0.0;

  void add(const HueModel& model, const ColourMarkerReading& rest, const std::vector<HueSample>& samples) {
    const HueEstimator estimator(model, rest);
    for (const HueSample& sample : samples) {
      const HueEstimate estimate = estimator.estimate(sample.marker, sample.seen);
      const Eigen::Vector3d error = estimate.displacement_mm - sample.displacement_mm;
      ++count;
      lateral += 0.5 * error.head<2>().squaredNorm();
      press += error.z() * error.z();
      largest = std::max(largest, error.norm());
    }
  }
  HueErrors errors() const {
    const double n = std::max<double>(1.0, static_cast<double>(count));
    return {count, std::sqrt(lateral / n), std::sqrt(press / n), largest};
  }
};

}  // namespace

HueErrors hue_errors(const HueModel& model, const ColourMarkerReading& rest, const std::vector<HueSample>& samples) {
  ErrorSums sums;
  sums.add(model, rest, samples);
  return sums.errors();
}

HueErrors cross_validate_hue(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                             const HueCalibrationSettings& settings) {
  std::set<int> series;
  for (const HueSample& sample : samples) series.insert(sample.series);
  if (series.size() < 2)
    fail("hue calibration: {} series of samples, 2 are needed to validate across them", series.size());
  ErrorSums sums;
  for (const int left_out : series) {
    std::vector<HueSample> seen, unseen;
    for (const HueSample& sample : samples) (sample.series == left_out ? unseen : seen).push_back(sample);
    sums.add(calibrate_hue(rest, seen, settings), rest, unseen);
  }
  return sums.errors();
}

std::vector<HueModelForm> usual_hue_forms() {
  std::vector<HueModelForm> forms{{.form = HueForm::kEquation4},
                                  {.form = HueForm::kEquation4, .of_ink = true},
                                  {.form = HueForm::kEquation4, .free_offset = true}};
  const std::array<HueFeatures, 5> sets{{{},
                                         {.coloured_area = false, .ink_area = false},
                                         {.coloured_area = false},
                                         {.ink_centroid = false, .coloured_area = false, .ink_area = false},
                                         {.centroid = false, .coloured_area = false, .ink_area = false}}};
  for (const HueFeatures& features : sets) {
    for (int degree = 1; degree <= 4; ++degree) {
      for (const double ridge : {1e-3, 1e-5, 1e-7}) {
        // Of all features, degree 4 has 329 terms: samples of one marker don't hold them.
        if (degree == 4 && features.indices().size() > 5) continue;
        forms.push_back({.features = features, .degree = degree, .ridge = ridge});
      }
    }
  }
  return forms;
}

std::vector<HueFormScore> rank_hue_forms(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                                         const HueCalibrationSettings& settings,
                                         const std::vector<HueModelForm>& forms) {
  std::vector<HueFormScore> scores;
  std::string last = "no form was given";
  for (const HueModelForm& form : forms) {
    HueCalibrationSettings of_form = settings;
    of_form.form = form;
    try {
      scores.push_back({form, cross_validate_hue(rest, samples, of_form)});
    } catch (const Error& error) {
      last = error.what();
    }
  }
  if (scores.empty()) fail("hue calibration: no form fits: {}", last);
  std::stable_sort(scores.begin(), scores.end(),
                   [](const HueFormScore& a, const HueFormScore& b) { return a.errors.rms_mm() < b.errors.rms_mm(); });
  return scores;
}

}  // namespace touchstone::sensors
