#pragma once
// Counts and forces of grasps by a formula, for tests of the estimators only: no light, no gel. An object of a given
// stiffness is pressed with a force that rises within 22 windows of 7 ms, is held for 100 and let go; what darkens is
// the area of contact, a power of the force that saturates earlier for a stiff object; events are its changes.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/random.h"
#include "sensors/events/event_windows.h"
#include "sensors/events/force_series.h"
#include "sensors/events/grasp_phases.h"
#include "sensors/events/grasp_sequence.h"
#include "sensors/events/material_classifier.h"

namespace touchstone::sensors {

/// The whole numbers from `begin` to before `end`.
inline std::vector<int> range(int begin, int end) {
  std::vector<int> indices(static_cast<std::size_t>(end - begin));
  std::iota(indices.begin(), indices.end(), begin);
  return indices;
}

struct SyntheticGrasp {
  std::vector<EventCounts> windows;
  Eigen::VectorXd force_N;  ///< of each window
  int first_touch = 30;
  int release = 30 + 22 + 100;
  int material = 0;
};

inline SyntheticGrasp synthetic_grasp(int index, int material, double noise_per_window = 20.0) {
  constexpr int kWindows = 30 + 22 + 100 + 22 + 6;
  RandomStream random(7, static_cast<std::uint64_t>(index), Purpose::kTest);
  SyntheticGrasp grasp;
  grasp.material = material;
  grasp.force_N = Eigen::VectorXd::Zero(kWindows);
  const double peak = 1.5 + 2.0 * random.uniform();
  const double speed = 0.8 + 0.4 * random.uniform();
  const double power = 0.4 + 0.15 * material;
  double before = 0.0;
  for (int window = 0; window < kWindows; ++window) {
    double force = 0.0;
    if (window >= grasp.first_touch && window < grasp.release) {
      const double travel = speed * (window + 1 - grasp.first_touch) / 22.0;
      force = peak * (1.0 - std::exp(-3.0 * travel));
    } else if (window >= grasp.release) {
      force = peak * std::exp(-0.5 * (window + 1 - grasp.release));
    }
    grasp.force_N[window] = force;
    const double area = std::pow(force / 3.5, power);
    const double change = 4000.0 * (area - before);
    before = area;
    EventCounts counts;
    counts.off = static_cast<std::int64_t>(random.poisson(noise_per_window + std::max(0.0, change)));
    counts.on = static_cast<std::int64_t>(random.poisson(noise_per_window + std::max(0.0, -1.5 * change)));
    grasp.windows.push_back(counts);
  }
  return grasp;
}

/// The same counts as events: evenly within each window of 7 ms from `start_us` on, the first at its very begin; at
/// places that go round a camera of 32 x 24.
inline std::vector<Event> events_of(const SyntheticGrasp& grasp, std::int64_t start_us = 0) {
  std::vector<Event> events;
  for (std::size_t window = 0; window < grasp.windows.size(); ++window) {
    const EventCounts& counts = grasp.windows[window];
    const std::int64_t all = counts.on + counts.off;
    for (std::int64_t k = 0; k < all; ++k) {
      const auto place = static_cast<int>((17 * k) % (32 * 24));
      // ON and OFF mixed in their shares.
      const bool on = (k + 1) * counts.on / all > k * counts.on / all;
      events.push_back({start_us + 7000 * static_cast<std::int64_t>(window) + 7000 * k / all,
                        static_cast<std::uint16_t>(place % 32), static_cast<std::uint16_t>(place / 32), on});
    }
  }
  return events;
}

inline ForceSeries synthetic_series(const SyntheticGrasp& grasp, bool with_time) {
  const GraspSequence sequence = grasp_sequence(grasp.windows, find_grasp_phases(grasp.windows));
  const int first = find_grasp_phases(grasp.windows).first_touch;
  ForceSeries series;
  series.features.resize(sequence.counts.rows(), with_time ? 3 : 2);
  series.features.leftCols(2) = sequence.counts;
  if (with_time) series.features.col(2) = sequence.time_s;
  series.force_N = grasp.force_N.segment(first, sequence.counts.rows());
  series.judged = sequence.judged;
  return series;
}

inline std::vector<ForceSeries> synthetic_series(int count, bool with_time) {
  std::vector<ForceSeries> series;
  for (int i = 0; i < count; ++i) series.push_back(synthetic_series(synthetic_grasp(i, i % 4), with_time));
  return series;
}

inline std::vector<MaterialSample> synthetic_samples(int count) {
  std::vector<MaterialSample> samples;
  for (int i = 0; i < count; ++i) {
    const ForceSeries series = synthetic_series(synthetic_grasp(i, i % 4), false);
    samples.push_back({grasp_features(series.features, series.judged), i % 4});
  }
  return samples;
}

}  // namespace touchstone::sensors
