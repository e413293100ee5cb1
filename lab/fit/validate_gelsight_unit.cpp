// Does a fit to a unit's recorded presses find the unit's numbers, within the intervals that it reports, and does it
// say what can't be identified? Units with hidden numbers are recorded by simulation with other seeds of light.

#include <algorithm>
#include <cmath>
#include <memory>

#include "lab/fit/unit_fit_experiment.h"
#include "lab/validation/row_list.h"

namespace touchstone::lab {
namespace {

constexpr int kCoarse_px = 4, kQuickCoarse_px = 8;
constexpr int kUnits = 20, kQuickUnits = 3;
constexpr int kUnitsALight = 5;  // fitted with light of one seed, so that its set-up is shared
constexpr int kBackgrounds = 4;
constexpr double kHiddenPart = 0.6;  // of the ranges, about their middle
constexpr double kMostError_percent = 2.0;
constexpr double kLeastCovered = 0.90;  // intervals of 95 %, of which a hundred are counted

struct Trials {
  int intervals = 0, covered = 0;     // the mesh's part included, as reported
  int narrow_covered = 0;             // without it: hidden units have the fit's own mesh
  double modulus = 0.0, lamps = 0.0;  // sums of squared relative errors
  int modulus_count = 0, lamp_count = 0;
};

void count(const PreparedFit& fit, const Eigen::VectorXd& hidden, const UnitFit& found, Trials& trials) {
  for (std::size_t k = 0; k < found.unknowns.size(); ++k) {
    const FittedUnknown& unknown = found.unknowns[k];
    const double truth = hidden_value(fit, hidden, k);
    const double off = std::log(unknown.value / truth);
    ++trials.intervals;
    if (truth >= unknown.low95 && truth <= unknown.high95) ++trials.covered;
    const double deviation = std::hypot(std::max(unknown.by_noise, unknown.by_model), unknown.by_light);
    if (std::abs(off) <= kNormal95 * deviation) ++trials.narrow_covered;
    const bool modulus = unknown.name == "gel.youngs_modulus_MPa";
    (modulus ? trials.modulus : trials.lamps) += off * off;
    ++(modulus ? trials.modulus_count : trials.lamp_count);
  }
}

bool names(const UnitFit& found, const std::string& one, const std::string& other) {
  return std::any_of(
      found.unidentified.begin(), found.unidentified.end(), [&](const UnidentifiableCombination& combination) {
        const auto has = [&](const std::string& name) {
          return std::any_of(combination.parts.begin(), combination.parts.end(),
                             [&](const UnidentifiableCombination::Part& part) { return part.name == name; });
        };
        return has(one) && has(other);
      });
}

}  // namespace

std::vector<ValidationRow> validate_gelsight_unit(const ValidateOptions& options) {
  RowList rows("gelsight.unit.", options, RowList::Since::begin);
  const int coarse = options.quick ? kQuickCoarse_px : kCoarse_px;
  const int units = options.quick ? kQuickUnits : kUnits;
  UnitFitSpec spec = flat_gelsight_fit(options.scenes, coarse);
  add_unknown(spec, "gel.youngs_modulus_MPa", UnknownHow::times, 0.3, 3.0);
  add_unknown(spec, "lamps[*].power_W", UnknownHow::times, 0.6, 1.7);
  Trials trials;
  PreparedFit fit;
  std::unique_ptr<UnitSimulation> simulation;
  for (int i = 0; i < units; ++i) {
    if (i % kUnitsALight == 0) {
      spec.seed = static_cast<std::uint64_t>(1 + 10 * (i / kUnitsALight));  // each lamp has a seed of its own from here
      fit = prepare_fit(spec);
      simulation = std::make_unique<UnitSimulation>(fit, options.cache);
    }
    const auto seed = static_cast<std::uint64_t>(i + 1);
    const Eigen::VectorXd hidden = hidden_unknowns(fit, kHiddenPart, seed);
    const RecordedUnit unit = record_unit(fit, hidden, kBackgrounds, seed, options.cache);
    count(fit, hidden, fit_unit(unit.fit, unit.recording, *simulation), trials);
    if (options.progress) options.progress("fitted units", i + 1, units);
  }
  const auto covered = [&](const char* id, const char* title, int inside) {
    const double percent = 100.0 * inside / trials.intervals;
    rows.add(id, title, "%", percent, Better::near, percent >= 100.0 * kLeastCovered).reference = 95.0;
  };
  covered("covered_percent", "hidden numbers within the reported 95 % intervals", trials.covered);
  covered("covered_without_mesh_percent", "the same without the mesh's part, since hidden units share the mesh",
          trials.narrow_covered);
  const auto error = [&](const char* id, const char* title, double squares, int number) {
    const double percent = 100.0 * std::sqrt(squares / number);
    rows.add(id, title, "%", percent, Better::lower, percent <= kMostError_percent).reference = kMostError_percent;
  };
  error("modulus_error_percent", "fitted modulus against the hidden one, root mean square", trials.modulus,
        trials.modulus_count);
  error("lamp_error_percent", "fitted powers of lamps against the hidden ones, root mean square", trials.lamps,
        trials.lamp_count);

  rows.begin();
  UnitFitSpec blurred = flat_gelsight_fit(options.scenes, kQuickCoarse_px);
  add_unknown(blurred, "lamps[*].power_W", UnknownHow::times, 0.6, 1.7, true);
  add_unknown(blurred, "camera.exposure_us", UnknownHow::times, 0.6, 1.7);
  const PreparedFit unclear = prepare_fit(blurred);
  const RecordedUnit unit =
      record_unit(unclear, hidden_unknowns(unclear, kHiddenPart, 1), kBackgrounds, 1, options.cache);
  const UnitFit found = fit_unit(unit.fit, unit.recording, options.cache);
  const bool named = names(found, "lamps[*].power_W", "camera.exposure_us") && !found.unknowns[0].identified &&
                     !found.unknowns[1].identified;
  rows.add("unidentifiable_named", "power and exposure, both unknown, are said not to be identified", "1", named,
           Better::near, named)
      .reference = 1.0;
  return rows.rows();
}

}  // namespace touchstone::lab
