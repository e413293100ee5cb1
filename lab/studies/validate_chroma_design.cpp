// The chroma sensor's design [Lin2019]: how thick its gel should be by eqs. 1 to 3 and by pressing it (sec. III.C, fig.
// 4c), what a tilt does to flat and to spherical markers (sec. V), and the four spectra of fig. 2.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "core/seconds_since.h"
#include "core/units.h"
#include "lab/chroma/chroma_design.h"
#include "lab/chroma/chroma_spectra.h"
#include "lab/chroma/chroma_tilt_experiment.h"
#include "lab/studies/study.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr double kForce_N = 0.25;  // eq. 3's strain is then 0.16, and fig. 8's ball can press so at any thickness
constexpr double kThicknessAllowed = 0.25;  // of the optimum, relative
constexpr double kTilt_deg = 30.0;
constexpr double kTextError_um = 350.0;  // "less than 350 um" (sec. IV.D): what a tilt may add at most
constexpr double kSpectraAllowed_percent = 5.0;
constexpr double kHueAllowed_deg = 10.0;  // a sixth of what parts red from yellow and from magenta
constexpr std::uint64_t kSeed = 8101;

/// Where the picture of a marker changes most: of the readings of eqs. 1 to 3 the one that has an optimum
/// (chroma_design.h), and of the pressed gel the same measure.
void add_thickness_rows(const ValidateOptions& options, std::vector<ValidationRow>& rows) {
  const auto begun = std::chrono::steady_clock::now();
  constexpr ApparentMeasure kMeasure = ApparentMeasure::picture_film_fixed;
  const auto measure = std::find(std::begin(kStudiedMeasures), std::end(kStudiedMeasures), kMeasure);
  ApparentChangeSpec spec =
      std::get<ApparentChangeSpec>(read_study(options.scenes / "studies" / "chroma-thickness.yaml").kind);
  spec.force_N = {kForce_N};
  spec.by = {options.quick ? ApparentSource::linear : ApparentSource::finite};
  spec.vary.values = options.quick ? std::vector<double>{0.5, 0.7, 1.0}
                                   : std::vector<double>{0.5, 0.6, 0.7, 0.85, 1.0, 1.5, 2.5, 5.0, 8.0};
  const ApparentChangeResult result = run_apparent_change(spec, options.cache, options.progress);
  const double seconds = seconds_since(begun);
  for (const ApparentOptimum& optimum : optima_of(result)) {
    if (optimum.measure != kMeasure) continue;
    const double lens = optimum.of.lens_mm;
    ChromaDesign design;
    design.marker = {spec.marker_mm, spec.device.gel.youngs_modulus_MPa, spec.device.gel.poisson_ratio};
    design.force_N = kForce_N;
    design.distance_mm = distance_in_view(spec.marker_mm, angle_of_view(lens, spec.sensor_mm), spec.markers_in_view);
    ValidationRow row;
    row.id = fmt::format("chroma.design.thickness_{:.0f}mm_mm", lens);
    row.title = fmt::format(
        "gel thickness at which {} N on a marker change its picture most, {:.0f} mm lens: pressed by a ball of 4 mm "
        "({}), against eqs. 1 to 3",
        kForce_N, lens, options.quick ? "linear" : "finite strain");
    row.unit = "mm";
    row.better = Better::near;
    row.reference = best_picture_thickness(design);
    // At an end of what was tried there's no optimum.
    row.ours = optimum.interior ? optimum.value : std::numeric_limits<double>::quiet_NaN();
    row.holds = std::abs(row.ours / *row.reference - 1.0) <= kThicknessAllowed;
    row.quick = options.quick;
    row.seconds = seconds / static_cast<double>(spec.lenses_mm.size());
    ValidationSeries series{"gel thickness, mm", "apparent change, % of the film's picture", {}};
    for (const ApparentChangeRow& one : result.rows) {
      if (one.lens_mm == lens) {
        series.points.emplace_back(one.value, 100.0 * one.measure[measure - std::begin(kStudiedMeasures)]);
      }
    }
    row.series = std::move(series);
    rows.push_back(std::move(row));
  }
}

/// Mean and 95 % interval over seeds.
struct OverSeeds {
  double mean = 0.0;
  std::optional<std::pair<double, double>> ci95;  ///< none with one seed
};
template <typename Values, typename Figure>
OverSeeds over_seeds(const Values& values, const Figure& figure) {
  OverSeeds over;
  const auto n = static_cast<double>(values.size());
  for (const auto& value : values) over.mean += figure(value) / n;
  if (values.size() < 2) return over;
  double variance = 0.0;
  for (const auto& value : values) variance += std::pow(figure(value) - over.mean, 2) / (n - 1.0);
  const double half = kNormal95 * std::sqrt(variance / n);
  over.ci95 = {over.mean - half, over.mean + half};
  return over;
}

/// A tilt of the surface about a marker's own centre, before the device's own camera: what it seems to be.
void add_tilt_rows(const ValidateOptions& options, std::vector<ValidationRow>& rows) {
  const TiltSpectra spectra = read_tilt_spectra(options.scenes / "spectra");
  TiltSetup setup = near_setup();
  setup.samples = options.quick ? 16 : 64;
  const int seeds = options.quick ? 1 : 4;
  const std::array<double, 1> tilts = {kTilt_deg * kRadiansPerDegree};
  const auto measure = [&](TiltMarker marker) {
    std::vector<TiltError> errors;
    for (int k = 0; k < seeds; ++k) {
      errors.push_back(
          measure_tilt(setup, spectra, marker, tilts, kSeed + static_cast<std::uint64_t>(100 * k), options.progress)
              .errors.front());
    }
    return errors;
  };
  const auto begun = std::chrono::steady_clock::now();
  const std::vector<TiltError> flat = measure(TiltMarker::flat);
  const std::vector<TiltError> ball = measure(TiltMarker::ball);
  struct TiltCase {
    const char* id;
    const char* what;
    const char* unit;
    double (*figure)(const TiltError&);
    std::optional<double> bound;  ///< of the flat marker; a ball is held against the flat one, which it is to better
  };
  const std::vector<TiltCase> cases = {
      {"press_um", "depth by hue", "um", [](const TiltError& e) { return std::abs(e.normal_um); }, kTextError_um},
      {"lateral_um", "lateral displacement by the ink's centroid", "um",
       [](const TiltError& e) { return std::hypot(e.lateral_um, e.across_um); }, kTextError_um},
      {"hue_deg", "change of hue", "deg", [](const TiltError& e) { return std::abs(e.hue_change) / kRadiansPerDegree; },
       std::nullopt},
      {"width_um", "depth by the ink's larger width", "um", [](const TiltError& e) { return std::abs(e.width_um); },
       kTextError_um},
  };
  const double seconds = seconds_since(begun);
  for (const TiltCase& one : cases) {
    const OverSeeds of_flat = over_seeds(flat, one.figure);
    const OverSeeds of_ball = over_seeds(ball, one.figure);
    for (const bool is_ball : {false, true}) {
      // A ball has no larger width.
      if (is_ball && std::string(one.id) == "width_um") continue;
      const OverSeeds& ours = is_ball ? of_ball : of_flat;
      ValidationRow row;
      row.id = fmt::format("chroma.tilt.{}_{}", is_ball ? "ball" : "flat", one.id);
      row.title = fmt::format("{} that a tilt of {:.0f} degrees feigns of a {} marker{}", one.what, kTilt_deg,
                              is_ball ? "spherical" : "flat", is_ball ? ", against a flat one" : "");
      row.unit = one.unit;
      row.reference = is_ball ? of_flat.mean : one.bound;
      row.ours = ours.mean;
      row.ci95 = ours.ci95;
      row.holds = !row.reference || row.ours <= *row.reference;
      row.quick = options.quick;
      row.seconds = seconds / 7.0;
      rows.push_back(std::move(row));
    }
  }
}

/// White, magenta, yellow and red as light on the sensor (chroma_spectra.h).
void add_spectra_rows(const ValidateOptions& options, std::vector<ValidationRow>& rows) {
  const auto begun = std::chrono::steady_clock::now();
  const sim::DeviceSpec device = sim::read_device(options.scenes / "devices" / "chroma.yaml");
  std::vector<ChromaSpectra> seen;
  const int seeds = options.quick ? 1 : 4;
  for (int k = 0; k < seeds; ++k) {
    seen.push_back(
        measure_chroma_spectra(device, options.cache, options.quick ? 32 : 512, kSeed + static_cast<std::uint64_t>(k)));
  }
  const double seconds = seconds_since(begun);
  const auto add = [&](std::string id, std::string title, const char* unit, double reference, double allowed,
                       const std::function<double(const ChromaSpectra&)>& figure) {
    const OverSeeds ours = over_seeds(seen, figure);
    ValidationRow row;
    row.id = std::move(id);
    row.title = std::move(title);
    row.unit = unit;
    row.reference = reference;
    row.ours = ours.mean;
    row.ci95 = ours.ci95;
    row.better = allowed > 0.0 ? Better::near : Better::lower;
    row.holds = allowed > 0.0 ? std::abs(row.ours - reference) <= allowed : row.ours <= reference;
    row.quick = options.quick;
    row.seconds = seconds / 5.0;
    rows.push_back(std::move(row));
  };
  add("chroma.spectra.error_percent",
      "worst of magenta, yellow and red: light on the sensor against white's times the products of the curves", "%",
      kSpectraAllowed_percent, 0.0, [](const ChromaSpectra& one) {
        double worst = 0.0;
        for (const ChromaColour colour : {ChromaColour::magenta, ChromaColour::yellow, ChromaColour::red}) {
          worst = std::max(worst, 100.0 * one.of(colour).error);
        }
        return worst;
      });
  add("chroma.spectra.white_error_percent",
      "white: light on the sensor against the product of lamp and white layer; the rest is colour that light brings "
      "along",
      "%", kSpectraAllowed_percent, 0.0,
      [](const ChromaSpectra& one) { return 100.0 * one.of(ChromaColour::white).error; });
  for (const ChromaColour colour : {ChromaColour::magenta, ChromaColour::yellow, ChromaColour::red}) {
    const ChromaSpectrum& first = seen.front().of(colour);
    add(fmt::format("chroma.spectra.{}_hue_deg", first.name),
        fmt::format("hue of {} as the sensor has it, against that of lamp and curves", first.name), "deg",
        first.product_hue.hue_deg, kHueAllowed_deg,
        [colour](const ChromaSpectra& one) { return one.of(colour).rendered_hue.hue_deg; });
  }
}

}  // namespace

std::vector<ValidationRow> validate_chroma_design(const ValidateOptions& options) {
  std::vector<ValidationRow> rows;
  add_thickness_rows(options, rows);
  add_tilt_rows(options, rows);
  add_spectra_rows(options, rows);
  return rows;
}

}  // namespace touchstone::lab
