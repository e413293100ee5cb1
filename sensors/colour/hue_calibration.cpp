#include "sensors/colour/hue_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "core/error.h"
#include "sensors/colour/hue_estimator.h"
#include "sensors/colour/hue_fit.h"

namespace touchstone::sensors {

namespace {

std::vector<HueRow> rows_of(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                            const HueCalibrationSettings& settings) {
  if (samples.size() < kLeastHueSamples) {
    fail("hue calibration: {} samples, at least {} are needed", samples.size(), kLeastHueSamples);
  }
  const PictureMap map = map_of_rest(rest, settings.spacing_mm);
  const std::vector<Eigen::Vector2d> places = grid_places(rest.grid, settings.spacing_mm);
  const bool of_surroundings = settings.form.form != HueForm::kEquation4 && settings.form.features.of_surroundings();
  std::vector<HueRow> rows;
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
    if (of_surroundings && !sample.seen.surroundings.known) continue;
    MarkerChange change = change_of(sample.seen, rest.markers[sample.marker], map);
    if (!of_surroundings) change.forget_surroundings();
    rows.push_back({sample.marker, change, settings.parallax.seen(sample.displacement_mm, places[sample.marker]),
                    -sample.displacement_mm.z()});
  }
  if (rows.size() < kLeastHueSamples) {
    fail("hue calibration: {} samples have sound neighbours, at least {} are needed", rows.size(), kLeastHueSamples);
  }
  return rows;
}

/// A change or displacement under the square's turns (by 0 to 3 quarters) and its mirroring.
Eigen::Vector2d turned(Eigen::Vector2d v, int symmetry) {
  for (int quarter = symmetry & 3; quarter > 0; --quarter) v = Eigen::Vector2d(-v.y(), v.x());
  if (symmetry & 4) v.x() = -v.x();
  return v;
}

HueRow turned(HueRow row, int symmetry) {
  row.change.centroid_mm = turned(row.change.centroid_mm, symmetry);
  row.change.ink_centroid_mm = turned(row.change.ink_centroid_mm, symmetry);
  row.lateral = turned(row.lateral, symmetry);
  return row;
}

std::vector<MarkerGain> fit_gains(const HueModel& model, const std::vector<HueRow>& rows) {
  const Eigen::MatrixXi terms = terms_of(model);
  std::set<std::size_t> markers;
  for (const HueRow& row : rows) markers.insert(row.marker);
  std::vector<MarkerGain> gains;
  for (const std::size_t marker : markers) {
    int count = 0;
    double lateral_square = 0.0, lateral_product = 0.0, press_square = 0.0, press_product = 0.0;
    for (const HueRow& row : rows) {
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
  if (form.form == HueForm::kEquation4) return;
  if (form.degree < 1 || form.degree > 4)
    fail("hue calibration: the degree is {}, it must be from 1 to 4", form.degree);
  if (!(form.ridge > 0.0 && form.ridge <= 1.0))
    fail("hue calibration: the ridge is {}, it must be above 0 and up to 1", form.ridge);
  if (form.features.indices().empty()) fail("hue calibration: the polynomial is of no feature");
  if (form.form == HueForm::kIsotropic && !form.features.centroid && !form.features.ink_centroid) {
    fail("hue calibration: an isotropic polynomial needs a centroid");
  }
}

}  // namespace

HueModel calibrate_hue(const ColourMarkerReading& rest, const std::vector<HueSample>& samples,
                       const HueCalibrationSettings& settings) {
  check(settings.form);
  std::vector<HueRow> rows = rows_of(rest, samples, settings);
  const auto count = rows.size();
  HueModel model;
  model.form = settings.form.form;
  model.spacing_mm = settings.spacing_mm;
  model.parallax = settings.parallax;
  const bool pressed = std::any_of(rows.begin(), rows.end(), [](const HueRow& row) { return row.press != 0.0; });
  const bool moved = std::any_of(rows.begin(), rows.end(), [](const HueRow& row) { return !row.lateral.isZero(0.0); });
  if (!pressed) fail("hue calibration: the samples have no press to fit to");
  if (!moved) fail("hue calibration: the samples have no lateral displacement to fit to");
  if (settings.form.form == HueForm::kEquation4) model.line = fit_line(rows, settings.form);
  if (settings.form.form == HueForm::kIsotropic) model.isotropic = fit_isotropic(rows, settings.form);
  if (settings.form.form != HueForm::kPolynomial || settings.form.symmetric) {
    rows.reserve(8 * count);
    for (int symmetry = 1; symmetry < 8; ++symmetry) {
      for (std::size_t i = 0; i < count; ++i) rows.push_back(turned(rows[i], symmetry));
    }
  }
  if (settings.form.form == HueForm::kPolynomial) model.polynomial = fit_polynomial(rows, settings.form);
  model.range = fit_range(rows);
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

double HueErrors::rms_of_all_mm() const {
  const auto estimated = static_cast<double>(samples), without = static_cast<double>(declined);
  const double squares = estimated * rms_mm() * rms_mm() + without * rms_declined_mm * rms_declined_mm;
  return std::sqrt(squares / std::max(1.0, estimated + without));
}

namespace {

struct ErrorSums {
  std::size_t count = 0, declined = 0;
  double lateral = 0.0, press = 0.0, largest = 0.0, unestimated = 0.0;

  void add(const HueModel& model, const ColourMarkerReading& rest, const std::vector<HueSample>& samples) {
    const HueEstimator estimator(model, rest);
    for (const HueSample& sample : samples) {
      const HueEstimate estimate = estimator.estimate(sample.marker, sample.seen);
      if (!estimate.measured) {
        ++declined;
        unestimated += sample.displacement_mm.squaredNorm();
        continue;
      }
      const Eigen::Vector3d error = estimate.displacement_mm - sample.displacement_mm;
      ++count;
      lateral += 0.5 * error.head<2>().squaredNorm();
      press += error.z() * error.z();
      largest = std::max(largest, error.norm());
    }
  }
  HueErrors errors() const {
    const double n = std::max<double>(1.0, static_cast<double>(count));
    const double without = std::max<double>(1.0, static_cast<double>(declined));
    return {count, std::sqrt(lateral / n), std::sqrt(press / n), largest, declined, std::sqrt(unestimated / without)};
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
  const std::array<HueFeatures, 7> sets{{{},
                                         {.coloured_area = false, .cell_area = true},
                                         {.coloured_area = false, .cell_area = true, .neighbour_area = true},
                                         {.coloured_area = false, .ink_area = false},
                                         {.coloured_area = false},
                                         {.ink_centroid = false, .coloured_area = false, .ink_area = false},
                                         {.centroid = false, .coloured_area = false, .ink_area = false}}};
  for (const HueFeatures& features : sets) {
    for (int degree = 1; degree <= 4; ++degree) {
      for (const double ridge : {1e-3, 1e-5, 1e-7}) {
        // Of all features, degree 4 has 329 terms: samples of one marker don't hold them.
        if (degree == 4 && features.indices().size() > 5) continue;
        forms.push_back({.form = HueForm::kIsotropic, .features = features, .degree = degree, .ridge = ridge});
        forms.push_back({.form = HueForm::kPolynomial, .features = features, .degree = degree, .ridge = ridge});
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
  std::stable_sort(scores.begin(), scores.end(), [](const HueFormScore& a, const HueFormScore& b) {
    return a.errors.rms_of_all_mm() < b.errors.rms_of_all_mm();
  });
  return scores;
}

}  // namespace touchstone::sensors
