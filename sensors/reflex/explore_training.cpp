#include "sensors/reflex/explore_training.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "sensors/reflex/left_out.h"

namespace touchstone::sensors {
namespace {

/// Puts the laws of what goes sideways into a model that knows presses and forces. @throws Error if they don't follow
void add_shear(std::span<const ExploreSample> samples, ExploreModel& model) {
  std::vector<LateralSample> lateral;
  for (const ExploreSample& sample : samples) {
    if (sample.press_mm <= 0.0) continue;
    if (!sample.lateral_mm || !sample.shear_N) fail("not every contact's lateral displacement and shear are known");
    lateral.push_back({sample.motion, *sample.lateral_mm});
  }
  ExploreModel with_shear = model;
  with_shear.lateral_mm_per_px = fit_lateral(lateral);
  std::vector<ShearSample> shear;
  for (const ExploreSample& sample : samples) {
    if (sample.press_mm <= 0.0) continue;
    const ExploreForce seen = estimate(with_shear, sample.motion);
    shear.push_back({seen.lateral_mm, seen.force_N, *sample.shear_N});
  }
  with_shear.shear = fit_shear_law(shear);
  model = with_shear;
}

/// Sums of squares while samples go by.
struct Sums {
  ExploreErrors errors;
  double press_mm2 = 0.0, normal_N2 = 0.0, shear_N2 = 0.0;
  int shears = 0;

  void add(const ExploreModel& model, std::span<const ExploreSample> samples) {
    for (const ExploreSample& sample : samples) {
      const ExploreForce seen = estimate(model, sample.motion);
      ++errors.samples;
      press_mm2 += std::pow(seen.press_mm - std::max(sample.press_mm, 0.0), 2);
      normal_N2 += std::pow(seen.force_N - sample.normal_N, 2);
      if (!model.shear || !sample.shear_N || sample.press_mm <= 0.0) continue;
      shear_N2 += (seen.shear_N - *sample.shear_N).squaredNorm();
      ++shears;
    }
  }
  ExploreErrors result() {
    if (errors.samples == 0) return errors;
    errors.press_rms_mm = std::sqrt(press_mm2 / errors.samples);
    errors.normal_rms_N = std::sqrt(normal_N2 / errors.samples);
    if (shears > 0) errors.shear_rms_N = std::sqrt(shear_N2 / shears);
    return errors;
  }
};

}  // namespace

TrainedExplore train_explore(std::span<const ExploreSample> samples, int terms) {
  std::vector<DilationSample> dilations;
  std::vector<PressSample> forces;
  for (const ExploreSample& sample : samples) {
    dilations.push_back({sample.motion.dilation, std::max(sample.press_mm, 0.0)});
    forces.push_back({sample.press_mm, sample.normal_N});
  }
  TrainedExplore made;
  made.model.press = fit_dilation_press(dilations, terms);
  made.model.force = fit_exponential_force(forces);
  try {
    add_shear(samples, made.model);
  } catch (const Error& error) {  // as of a plate that only goes up and down
    made.no_shear = error.what();
  }
  return made;
}

ExploreErrors test_explore(const ExploreModel& model, std::span<const ExploreSample> samples) {
  Sums sums;
  sums.add(model, samples);
  return sums.result();
}

std::optional<ExploreErrors> cross_validate_explore(std::span<const std::vector<ExploreSample>> sequences, int terms) {
  Sums sums;
  const auto train = [&](const std::vector<std::vector<ExploreSample>>& others) {
    std::vector<ExploreSample> samples;
    for (const std::vector<ExploreSample>& one : others) samples.insert(samples.end(), one.begin(), one.end());
    return train_explore(samples, terms).model;
  };
  const bool done = test_left_out(
      sequences, train,
      [&](const ExploreModel& model, const std::vector<ExploreSample>& sequence) { sums.add(model, sequence); });
  return done ? std::optional(sums.result()) : std::nullopt;
}

}  // namespace touchstone::sensors
