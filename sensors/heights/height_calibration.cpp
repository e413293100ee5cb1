#include "sensors/heights/height_calibration.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kPressesToCompare = 3;
constexpr std::size_t kCellsToCompare = 1U << 17U;  // coarser tables serve to compare corrections

using Samples = std::vector<ColourSample>;

Samples corrected_samples(const Samples& samples, const ColourCorrection& correction) {
  Samples corrected = samples;
  for (ColourSample& sample : corrected) {
    sample.colour = (correction.at(sample.place.cast<double>()) * sample.colour.cast<double>()).cast<float>();
  }
  return corrected;
}

struct FittedLight {
  LampModel lamps;
  ColourCorrection correction;
};

FittedLight fit_light(const Samples& samples, const Background& background, const HeightCalibrationSettings& settings,
                      LightCorrection kind) {
  const ColourCorrection by_background = ColourCorrection::by_background(background.mean);
  FittedLight light;
  light.lamps = fit_lamps(corrected_samples(samples, by_background), background.mean.size(), settings.lamps);
  if (kind == LightCorrection::background) light.correction = by_background;
  if (kind == LightCorrection::fitted) light.correction = ColourCorrection::by_lamps(background.mean, light.lamps);
  return light;
}

/// The samples as they would have been seen in the middle, and the table made of them.
struct Learnt {
  FittedLight light;
  Samples corrected;
  SlopeTable table;
};

Learnt learn(const Samples& samples, const Background& background, const HeightCalibrationSettings& settings,
             LightCorrection kind) {
  Learnt learnt;
  learnt.light = fit_light(samples, background, settings, kind);
  learnt.corrected = corrected_samples(samples, learnt.light.correction);
  // The table's own lamps: of the corrected colours, which are the same everywhere.
  LampFit even = kEvenLamps;
  even.steepest = settings.lamps.steepest;
  const LampModel middle = fit_lamps(learnt.corrected, background.mean.size(), even);
  learnt.table = build_slope_table(learnt.corrected, middle.nodes.front(), settings.table);
  return learnt;
}

double squared_error(const SlopeTable& table, const Samples& corrected) {
  double sum = 0.0;
  for (const ColourSample& sample : corrected) {
    sum += (table.slopes[table.index_of(sample.colour)] - sample.slope).squaredNorm();
  }
  return sum;
}

double left_out_error(const std::vector<Samples>& presses, const Background& background,
                      HeightCalibrationSettings settings, LightCorrection kind) {
  settings.table.most_cells = std::min(settings.table.most_cells, kCellsToCompare);
  double squares = 0.0;
  std::size_t pixels = 0;
  for (std::size_t out = 0; out < presses.size(); ++out) {
    Samples others;
    for (std::size_t i = 0; i < presses.size(); ++i) {
      if (i != out) others.insert(others.end(), presses[i].begin(), presses[i].end());
    }
    const Learnt learnt = learn(others, background, settings, kind);
    squares += squared_error(learnt.table, corrected_samples(presses[out], learnt.light.correction));
    pixels += presses[out].size();
  }
  return std::sqrt(squares / (2.0 * static_cast<double>(pixels)));
}

}  // namespace

HeightCalibration calibrate_height(std::span<const BallPress> presses, const Background& background,
                                   const HeightCalibrationSettings& settings) {
  if (!(settings.mm_per_px > 0.0) || !std::isfinite(settings.mm_per_px)) {
    fail("mm_per_px {}: it must be above 0", settings.mm_per_px);
  }
  if (presses.empty()) fail("no ball press: at least one calibration frame is needed");
  std::vector<Samples> parts;
  Samples all;
  for (const BallPress& press : presses) {
    parts.push_back(samples_of(press, background, settings.mm_per_px, settings.sampling));
    all.insert(all.end(), parts.back().begin(), parts.back().end());
  }
  if (all.empty()) fail("the ball presses have no pixel that can be used");
  HeightCalibration result;
  LightCorrection kind = settings.correction.value_or(LightCorrection::background);
  if ((settings.cross_validate || !settings.correction) && presses.size() >= kPressesToCompare) {
    for (const LightCorrection tried : {LightCorrection::none, LightCorrection::background, LightCorrection::fitted}) {
      result.left_out.push_back({tried, left_out_error(parts, background, settings, tried)});
    }
    const auto best = std::min_element(result.left_out.begin(), result.left_out.end(),
                                       [](const SlopeError& a, const SlopeError& b) { return a.rms < b.rms; });
    if (!settings.correction) kind = best->correction;
  }
  Learnt learnt = learn(all, background, settings, kind);
  result.pixels = all.size();
  result.rms_slope_error =
      std::sqrt(squared_error(learnt.table, learnt.corrected) / (2.0 * static_cast<double>(all.size())));
  result.bounded_share = learnt.light.correction.bounded_share();
  result.coverage = coverage_of(learnt.table, learnt.corrected);
  HeightModel& model = result.model;
  model.mm_per_px = settings.mm_per_px;
  model.background = background;
  model.correction = kind;
  model.lamps = std::move(learnt.light.lamps);
  model.table = std::move(learnt.table);
  model.steepest_calibrated = result.coverage.steepest_slope;
  model.presses = static_cast<int>(presses.size());
  const std::string fault = fault_of(model);
  if (!fault.empty()) fail("the calibration gave no usable model: {}", fault);
  return result;
}

}  // namespace touchstone::sensors
