#include "lab/dvs/dvs_sequences.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr int kTextWindow_ms = 7;
constexpr double kReading_s = 0.007;

/// So many of the windows of [Naeini2020], in windows of another length.
int windows_of_time(int text_windows, int window_ms) {
  return std::max(1, (text_windows * kTextWindow_ms + window_ms / 2) / window_ms);
}

/// The readings' course at a moment.
double force_at(std::span<const sim::ForceReading> readings, double sim::ForceReading::*force, double seconds) {
  const auto middle = [](const sim::ForceReading& reading) { return reading.seconds - 0.5 * kReading_s; };
  const auto after = std::find_if(readings.begin(), readings.end(),
                                  [&](const sim::ForceReading& reading) { return middle(reading) > seconds; });
  if (after == readings.end()) return readings.back().*force;
  const double behind = (middle(*after) - seconds) / kReading_s;
  if (after == readings.begin()) return behind >= 1.0 ? 0.0 : (1.0 - behind) * ((*after).*force);
  return behind * ((*(after - 1)).*force) + (1.0 - behind) * ((*after).*force);
}

/// Its counts in windows. @throws Error for a kind of pixels that wasn't recorded
std::vector<sensors::EventCounts> windows_seen(const DvsRecording& recording, const DvsSequenceSettings& settings) {
  if (settings.pixels < 0 || static_cast<std::size_t>(settings.pixels) >= recording.by_pixels.size()) {
    fail("dvs sequences: event pixels {} are asked for, {} kinds were recorded", settings.pixels,
         recording.by_pixels.size());
  }
  dvs_phase_settings(settings.window_ms);  // refuses the length
  return windows_of(recording.by_pixels[static_cast<std::size_t>(settings.pixels)], 0, settings.window_ms);
}

DvsSequence sequence_of(const DvsRecording& recording, std::span<const sensors::EventCounts> windows,
                        const sensors::GraspPhases& phases, const DvsSequenceSettings& settings) {
  DvsSequence sequence;
  sequence.material = recording.parameters.material;
  sequence.phases = phases;
  sequence.windows = sensors::grasp_sequence(windows, phases, 1000LL * settings.window_ms, settings.accumulation);
  // Rows are windows from the touch on; without the hold they are fewer than the windows.
  const Eigen::Index all = phases.release_end - phases.first_touch;
  const double first_s = 1e-3 * settings.window_ms * phases.first_touch;
  const auto forces = [&](double sim::ForceReading::*force) -> Eigen::VectorXd {
    const Eigen::VectorXd whole = window_forces(recording.readings, force, first_s, settings.window_ms, all);
    const Eigen::Index rows = sequence.windows.counts.rows();
    if (rows == all) return whole;
    Eigen::VectorXd judged(rows);
    judged << whole.head(sequence.windows.grasp_windows), whole.tail(rows - sequence.windows.grasp_windows);
    return judged;
  };
  sequence.measured_N = forces(&sim::ForceReading::measured_N);
  sequence.true_N = forces(&sim::ForceReading::true_N);
  const auto end_ms = [&](int window) { return static_cast<double>(settings.window_ms * (window + 1)); };
  sequence.touch_delay_ms = end_ms(phases.first_touch) - 1e3 * recording.touch_s;
  sequence.release_delay_ms = end_ms(phases.release_begin) - 1e3 * recording.release_s;
  sequence.apart_ms = 1e3 * recording.apart_s - end_ms(phases.release_begin);
  return sequence;
}

}  // namespace

sensors::GraspPhaseSettings dvs_phase_settings(int window_ms) {
  if (window_ms < 1 || window_ms > 70) fail("dvs sequences: windows of {} ms; they must be 1 to 70 ms long", window_ms);
  sensors::GraspPhaseSettings settings;
  settings.background_windows = std::max(2, windows_of_time(settings.background_windows, window_ms));
  settings.grasp_windows = windows_of_time(settings.grasp_windows, window_ms);
  settings.least_hold_windows =
      std::max(settings.background_windows, windows_of_time(settings.least_hold_windows, window_ms));
  settings.release_windows = windows_of_time(settings.release_windows, window_ms);
  return settings;
}

Eigen::VectorXd window_forces(std::span<const sim::ForceReading> readings, double sim::ForceReading::*force,
                              double first_window_s, int window_ms, Eigen::Index windows) {
  const double length_s = 1e-3 * window_ms;
  constexpr double kRounding_s = 1e-6;
  const double end_s = first_window_s + length_s * static_cast<double>(windows);
  if (readings.empty() || end_s > readings.back().seconds + 0.5 * kReading_s + kRounding_s) {
    fail("dvs sequences: the last window ends at {:.3f} s, the readings at {:.3f} s", end_s,
         readings.empty() ? 0.0 : readings.back().seconds);
  }
  const int moments = std::max(1, static_cast<int>(std::lround(length_s / kReading_s)));
  Eigen::VectorXd forces(windows);
  for (Eigen::Index window = 0; window < windows; ++window) {
    double sum = 0.0;
    for (int k = 0; k < moments; ++k) {
      const double part = (k + 0.5) / moments;
      sum += force_at(readings, force, first_window_s + length_s * (static_cast<double>(window) + part));
    }
    forces[window] = sum / moments;
  }
  return forces;
}

DvsSequences dvs_sequences(std::span<const DvsRecording> recordings, const DvsSequenceSettings& settings) {
  const sensors::GraspPhaseSettings phases = dvs_phase_settings(settings.window_ms);
  DvsSequences all;
  for (const DvsRecording& recording : recordings) {
    const std::vector<sensors::EventCounts> windows = windows_seen(recording, settings);
    std::optional<sensors::GraspPhases> found;
    try {
      found = sensors::find_grasp_phases(windows, phases);
    } catch (const Error& error) {
      all.unseen.push_back(fmt::format("grasp with noise seed {}: {}", recording.parameters.noise_seed, error.what()));
      for (const sim::ForceReading& reading : recording.readings) {
        all.unseen_peak_N = std::max(all.unseen_peak_N, reading.true_N);
      }
    }
    if (found) all.seen.push_back(sequence_of(recording, windows, *found, settings));
  }
  return all;
}

std::vector<sensors::ForceSeries> force_series_of(std::span<const DvsSequence> sequences, DvsForce force,
                                                  DvsInputs inputs) {
  std::vector<sensors::ForceSeries> all;
  for (const DvsSequence& sequence : sequences) {
    sensors::ForceSeries& series = all.emplace_back();
    if (inputs == DvsInputs::time) {
      series.features = sequence.windows.time_s;
    } else {
      series.features = sequence.windows.counts;
    }
    if (inputs == DvsInputs::counts_and_time) {
      series.features.conservativeResize(Eigen::NoChange, 3);
      series.features.col(2) = sequence.windows.time_s;
    }
    series.force_N = force == DvsForce::measured ? sequence.measured_N : sequence.true_N;
    series.judged = sequence.windows.judged;
  }
  return all;
}

std::vector<sensors::MaterialSample> event_samples(std::span<const DvsSequence> sequences) {
  std::vector<sensors::MaterialSample> samples;
  for (const DvsSequence& sequence : sequences) {
    samples.push_back({sensors::grasp_features(sequence.windows.counts, sequence.windows.judged), sequence.material});
  }
  return samples;
}

std::vector<sensors::MaterialSample> force_sensor_samples(std::span<const DvsSequence> sequences) {
  std::vector<sensors::MaterialSample> samples;
  for (const DvsSequence& sequence : sequences) {
    samples.push_back({sensors::grasp_features(sequence.measured_N, sequence.windows.judged), sequence.material});
  }
  return samples;
}

}  // namespace touchstone::lab
