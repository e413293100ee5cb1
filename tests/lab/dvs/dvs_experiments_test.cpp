// The experiments on recordings made by hand: a law from force to counts that is known, and faults.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <span>

#include "core/error.h"
#include "core/random.h"
#include "lab/dvs/dvs_force_experiment.h"
#include "sensors/events/material_trial.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;

constexpr int kTouch_ms = 200;
constexpr int kRelease_ms = 1050;
constexpr int kEnd_ms = 1300;

/// N, at a time in ms: rises within 100 ms, holds, falls within 20 ms.
double force_of(double t_ms, double peak_N) {
  if (t_ms < kTouch_ms) return 0.0;
  if (t_ms < kRelease_ms) return peak_N * std::min(1.0, (t_ms - kTouch_ms) / 100.0);
  return peak_N * std::max(0.0, 1.0 - (t_ms - kRelease_ms) / 20.0);
}

/// As many OFF events as the force grows by, times what is the material's own, ON events as it falls; noise beside it.
DvsRecording made(int material, double peak_N, std::uint64_t seed, int end_ms = kEnd_ms) {
  DvsRecording recording;
  recording.parameters.material = material;
  recording.parameters.noise_seed = seed;
  recording.touch_s = 1e-3 * kTouch_ms;
  recording.release_s = 1e-3 * kRelease_ms;
  recording.apart_s = 1e-3 * (kRelease_ms + 20);
  const double per_N = 4000.0 * (1.0 + 0.5 * material);
  RandomStream random(seed, 0, Purpose::kTest);
  DvsEvents events;
  for (int t = 0; t < end_ms; ++t) {
    const double change = per_N * (force_of(t + 1, peak_N) - force_of(t, peak_N));
    const std::int64_t noise = random.uniform() < 0.3 ? 1 : 0;
    events.counts.push_back({noise + std::llround(std::max(0.0, -change)), std::llround(std::max(0.0, change))});
  }
  recording.by_pixels = {events};
  for (int t = kTouch_ms; t + 7 <= end_ms; t += 7) {
    double mean = 0.0;
    for (int k = 0; k < 7; ++k) mean += force_of(t + k + 0.5, peak_N) / 7.0;
    recording.readings.push_back({1e-3 * (t + 7), mean, 1.1 * mean, 1.1 * mean});
  }
  return recording;
}

std::vector<DvsRecording> some(int grasps) {
  std::vector<DvsRecording> all;
  for (int i = 0; i < grasps; ++i) all.push_back(made(i % 4, 0.6 + 0.25 * (i % 7), static_cast<std::uint64_t>(i + 1)));
  return all;
}

std::string error_of(const auto& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// Of one grasp. @throws Error where it isn't seen
DvsSequence dvs_sequence(const DvsRecording& recording, const DvsSequenceSettings& settings = {}) {
  const DvsSequences all = dvs_sequences(std::span(&recording, 1), settings);
  if (!all.unseen.empty()) fail("{}", all.unseen[0]);
  return all.seen.at(0);
}

TEST(DvsSequences, BeginWithTheTouchAndHaveTheForcesOfTheirWindows) {
  const DvsSequence sequence = dvs_sequence(made(1, 1.4, 5));
  // 200 ms is in window 28 (196 to 203 ms), 1050 ms the begin of window 150.
  EXPECT_EQ(sequence.phases.first_touch, 28);
  EXPECT_NEAR(sequence.touch_delay_ms, 3.0, 1e-9);
  EXPECT_EQ(sequence.phases.release_begin, 150);
  EXPECT_NEAR(sequence.release_delay_ms, 7.0, 1e-9);
  EXPECT_NEAR(sequence.apart_ms, 13.0, 1e-9);
  EXPECT_EQ(sequence.windows.judged.size(), 44u) << "22 of the grasp, 22 of the release";
  EXPECT_EQ(sequence.windows.counts.rows(), 150 + 22 - 28);
  for (Eigen::Index row = 1; row < sequence.true_N.size(); ++row) {
    const double from = 196.0 + 7.0 * static_cast<double>(row);
    if (from > kRelease_ms - 8 || from > kTouch_ms + 90) continue;  // straight pieces only: there the course is exact
    EXPECT_NEAR(sequence.true_N[row], force_of(from + 3.5, 1.4), 1e-9) << row;
    EXPECT_NEAR(sequence.measured_N[row], 1.1 * sequence.true_N[row], 1e-12);
  }
  EXPECT_NEAR(sequence.true_N.maxCoeff(), 1.4, 1e-9);
}

TEST(DvsSequences, LeaveTheHoldOutIfAsked) {
  const DvsSequence sequence = dvs_sequence(made(1, 1.4, 5), {.accumulation = sensors::Accumulation::kSkipHold});
  EXPECT_EQ(sequence.windows.counts.rows(), 44);
  EXPECT_EQ(sequence.true_N.size(), 44);
  EXPECT_NEAR(sequence.true_N[21], 1.4, 1e-9);
  EXPECT_LT(sequence.true_N[43], 1e-9);
}

TEST(DvsSequences, WindowsOfOtherLengthsSpanTheSameTime) {
  for (const int length : {3, 14, 28}) {
    const DvsSequence sequence = dvs_sequence(made(0, 2.0, 3), {.window_ms = length});
    EXPECT_NEAR(static_cast<double>(sequence.windows.grasp_windows) * length, 154.0, 0.5 * length);
    EXPECT_LE(sequence.touch_delay_ms, length);
    EXPECT_NEAR(sequence.true_N.maxCoeff(), 2.0, 1e-9);
  }
  // A window of 28 ms on a straight rise has the mean of its four parts: the force in its middle.
  const auto readings = made(0, 2.0, 3).readings;
  EXPECT_NEAR(window_forces(readings, &sim::ForceReading::true_N, 0.21, 28, 1)[0], force_of(224.0, 2.0), 1e-9);
}

TEST(DvsSequences, SayWhatIsWrong) {
  DvsRecording untouched = made(0, 2.0, 77);
  for (sensors::EventCounts& count : untouched.by_pixels[0].counts) count.off = 0;
  EXPECT_THAT(error_of([&] { dvs_sequence(untouched); }),
              HasSubstr("grasp with noise seed 77: grasp phases: there is no touch"));
  const DvsSequences two = dvs_sequences(std::vector<DvsRecording>{untouched, made(3, 1.0, 78)});
  ASSERT_EQ(two.seen.size(), 1u);
  EXPECT_EQ(two.seen[0].material, 3);
  ASSERT_EQ(two.unseen.size(), 1u);
  EXPECT_THAT(two.unseen[0], HasSubstr("grasp with noise seed 77: grasp phases: there is no touch"));
  EXPECT_NEAR(two.unseen_peak_N, 2.0, 1e-9);
  EXPECT_THAT(error_of([] { dvs_sequence(made(0, 2.0, 1), {.pixels = 1}); }), HasSubstr("pixels 1"));
  EXPECT_THAT(error_of([] { dvs_sequence(made(0, 2.0, 1), {.window_ms = 0}); }), HasSubstr("1 to 70"));
  EXPECT_THAT(error_of([] { dvs_phase_settings(71); }), HasSubstr("1 to 70"));
  DvsRecording short_of_force = made(0, 2.0, 4);
  short_of_force.readings.resize(100);
  EXPECT_THAT(error_of([&] { dvs_sequence(short_of_force); }), HasSubstr("the readings at 0.900 s"));
}

TEST(DvsForceExperiment, LearnsALawThatOnlyTheMaterialsBlur) {
  const std::vector<DvsRecording> recordings = some(12);
  std::vector<DvsRecording> alike = recordings;
  for (std::size_t i = 0; i < alike.size(); ++i) {
    alike[i] = made(0, 0.6 + 0.25 * static_cast<double>(i % 6), i + 1);  // of one material, each force twice
  }
  DvsForceSettings settings;
  settings.learned = DvsForce::truth;
  settings.validation = 3;
  sensors::TuningSettings tuning;
  const DvsForceScore one = test_force_processes(dvs_sequences(alike).seen, tuning, settings);
  ASSERT_EQ(one.folds.size(), 12u);
  EXPECT_LT(one.mean(&DvsForceFold::test_mse), 0.01) << "OFF less ON over 4000 is the force";
  EXPECT_EQ(one.mean(&DvsForceFold::test_mse), one.mean(&DvsForceFold::true_mse));
  // Time alone can't tell how hard each one is pressed: a variance of some (0.25 N)^2 (36 - 1) / 12 in the hold.
  const DvsForceScore clock = test_force_processes(dvs_sequences(alike).seen, tuning, settings, {}, DvsInputs::time);
  EXPECT_GT(clock.mean(&DvsForceFold::test_mse), 5.0 * one.mean(&DvsForceFold::test_mse));
  sensors::TimeDelayNetworkSettings network;
  network.hidden_layers = 1;
  network.units = 5;
  network.training.most_steps = 60;
  const DvsForceScore net = test_force_networks(dvs_sequences(alike).seen, network, settings);
  EXPECT_LT(net.mean(&DvsForceFold::test_mse), 0.01);
  EXPECT_GT(net.folds.front().steps, 0);
  EXPECT_GT(net.sensitivity_N(), 0.0);
  // The reference sensor's errors: 10 % of the force, squared, and nothing else.
  settings.learned = DvsForce::measured;
  const DvsForceScore measured = test_force_processes(dvs_sequences(alike).seen, tuning, settings);
  EXPECT_GT(measured.mean(&DvsForceFold::true_mse), measured.mean(&DvsForceFold::test_mse));
  for (const DvsForceFold& fold : measured.folds) {
    const DvsSequence sequence = dvs_sequence(alike[static_cast<std::size_t>(fold.grasp)]);
    EXPECT_NEAR(fold.sensor_mse, 0.01 * sequence.true_N(sequence.windows.judged).squaredNorm() / 44.0, 1e-9);
  }
}

TEST(DvsForceExperiment, FoldsAreTheSameForAnyNumberOfThreadsAndMayBeSparse) {
  const std::vector<DvsSequence> sequences = dvs_sequences(some(8)).seen;
  sensors::TimeDelayNetworkSettings network;
  network.hidden_layers = 2;
  network.units = 4;
  network.training.most_steps = 8;
  DvsForceSettings settings;
  settings.validation = 2;
  settings.threads = 1;
  const DvsForceScore alone = test_force_networks(sequences, network, settings);
  settings.threads = 4;
  const DvsForceScore together = test_force_networks(sequences, network, settings);
  settings.every = 3;
  const DvsForceScore sparse = test_force_networks(sequences, network, settings);
  ASSERT_EQ(alone.folds.size(), 8u);
  ASSERT_EQ(sparse.folds.size(), 3u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(alone.folds[i].test_mse, together.folds[i].test_mse);
    EXPECT_EQ(alone.folds[i].true_mse, together.folds[i].true_mse);
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(sparse.folds[i].test_mse, alone.folds[3 * i].test_mse);
  settings.every = 0;
  EXPECT_THAT(error_of([&] { test_force_networks(sequences, network, settings); }), HasSubstr("every 0 folds"));
  settings.every = 1;
  settings.validation = 7;
  EXPECT_THROW(test_force_networks(sequences, network, settings), Error) << "none left to train on";
}

TEST(DvsForceExperiment, StandardErrorIsThatOfAMean) {
  DvsForceScore score;
  for (const double value : {1.0, 3.0}) score.folds.emplace_back().test_mse = value;
  EXPECT_DOUBLE_EQ(score.mean(&DvsForceFold::test_mse), 2.0);
  EXPECT_DOUBLE_EQ(score.standard_error(&DvsForceFold::test_mse), 1.0);  // sqrt(2 / 1 / 2)
  score.folds.resize(1);
  EXPECT_EQ(score.standard_error(&DvsForceFold::test_mse), 0.0);
  EXPECT_THROW(score.sensitivity_N(), Error);
}

const std::vector<std::string> kMaterials = {"foam", "rubber", "silicone", "steel"};

// Counts tell the materials of this law apart, forces don't: all materials see the same ones.
TEST(DvsMaterialExperiment, TellsMaterialsByEventsAndNotByForce) {
  std::vector<DvsRecording> recordings;
  for (int i = 0; i < 24; ++i) recordings.push_back(made(i % 4, 1.8 + 0.05 * (i / 4), static_cast<std::uint64_t>(i)));
  const std::vector<DvsSequence> sequences = dvs_sequences(recordings).seen;
  sensors::MaterialTrialSettings settings;
  settings.classifier.hidden_layers = 1;
  settings.classifier.units = 10;
  settings.classifier.patience = 30;  // four grasps to validate on stop it early and by chance
  const sensors::MaterialTrialScore by_events =
      sensors::test_material_classifiers(event_samples(sequences), kMaterials, settings);
  EXPECT_EQ(by_events.test.counts.sum(), 24);
  EXPECT_EQ(by_events.validation.counts.sum(), 24 * 4);
  EXPECT_GT(by_events.test.accuracy(), 0.75) << "of 24, 20 to train on: neighbours are mixed up at times";
  const sensors::MaterialTrialScore by_force =
      sensors::test_material_classifiers(force_sensor_samples(sequences), kMaterials, settings);
  EXPECT_LT(by_force.test.accuracy(), 0.55) << "a guess is right in a quarter of all";
  settings.threads = 1;
  EXPECT_EQ(sensors::test_material_classifiers(event_samples(sequences), kMaterials, settings).test.counts,
            by_events.test.counts);
}

TEST(DvsMaterialExperiment, RefusesAMissingMaterial) {
  std::vector<sensors::MaterialSample> samples = event_samples(dvs_sequences(some(12)).seen);
  EXPECT_THAT(error_of([&] {
                sensors::test_material_classifiers(samples, {"foam", "rubber", "silicone"}, {});
              }),
              HasSubstr("of material 3, there are 3"));
  for (sensors::MaterialSample& sample : samples) {
    if (sample.label == 2) sample.label = 1;
  }
  EXPECT_THAT(error_of([&] { sensors::test_material_classifiers(samples, kMaterials, {}); }),
              HasSubstr("0 grasps of silicone"));
}

}  // namespace
}  // namespace touchstone::lab
