#include "sensors/events/known_grasp.h"

#include <algorithm>

#include "core/error.h"

namespace touchstone::sensors {

KnownGrasp known_grasp(std::span<const EventCounts> windows, const EventWindowSettings& settings,
                       const ForceReadings* readings, const std::string& name) {
  const GraspPhases phases = find_grasp_phases(windows);
  KnownGrasp grasp{grasp_sequence(windows, phases, settings.length_us)};
  if (readings == nullptr) return grasp;
  const auto begin_us = [&](std::int64_t window) { return settings.start_us + window * settings.length_us; };
  if (readings->t_us.back() < begin_us(phases.release_end - 1)) {
    fail("{}: ends at {} us; the release ends at {} us", name, readings->t_us.back(), begin_us(phases.release_end));
  }
  grasp.force_N.resize(phases.release_end - phases.first_touch);
  for (int window = phases.first_touch; window < phases.release_end; ++window) {
    grasp.force_N[window - phases.first_touch] = mean_force_N(*readings, begin_us(window), begin_us(window + 1));
  }
  return grasp;
}

ForceSeries force_series_of(const KnownGrasp& grasp, bool with_time) {
  ForceSeries series;
  series.features = grasp.sequence.counts;
  if (with_time) {
    series.features.conservativeResize(Eigen::NoChange, 3);
    series.features.col(2) = grasp.sequence.time_s;
  }
  series.force_N = grasp.force_N;
  series.judged = grasp.sequence.judged;
  return series;
}

MaterialSample material_sample_of(const KnownGrasp& grasp, std::vector<std::string>& materials) {
  auto known = std::ranges::find(materials, grasp.material);
  if (known == materials.end()) known = materials.insert(known, grasp.material);
  return {grasp_features(grasp.sequence.counts, grasp.sequence.judged), static_cast<int>(known - materials.begin())};
}

}  // namespace touchstone::sensors
