#include "lab/vhs/palpation_experiment.h"

#include <tbb/parallel_for.h>

#include <functional>

#include "core/error.h"

namespace touchstone::lab {
namespace {

/// A press of a trial: which piece, and the number that its random streams go by.
struct Press {
  int material = 0;
  PalpationSet set = PalpationSet::training;
  std::uint64_t piece = 0;
  std::uint64_t index = 0;
};

std::vector<Press> presses_of(const PalpationSpec& spec, const PalpationTrialSettings& settings) {
  TS_ASSERT(settings.training_pieces > 0 && settings.validation_pieces > 0 && settings.test_pieces > 0 &&
            settings.presses > 0);
  std::vector<Press> presses;
  std::uint64_t piece = 0;
  for (std::size_t m = 0; m < spec.materials.size(); ++m) {
    const auto add = [&](PalpationSet set, int pieces) {
      for (int i = 0; i < pieces; ++i, ++piece) {
        for (int k = 0; k < settings.presses; ++k) presses.push_back({static_cast<int>(m), set, piece, presses.size()});
      }
    };
    add(PalpationSet::training, settings.training_pieces);
    add(PalpationSet::validation, settings.validation_pieces);
    add(PalpationSet::test, settings.test_pieces);
  }
  return presses;
}

using Sensor = std::function<std::vector<double>(const PressedPiece&, const PalpationRun&, std::uint64_t index)>;

PalpationRecording record(const PalpationSpec& spec, const PalpationTable& table,
                          const std::vector<std::vector<LumpMode>>& modes, const PalpationTrialSettings& settings,
                          double rate_Hz, const Sensor& sensor) {
  const std::vector<Press> presses = presses_of(spec, settings);
  PalpationRecording recording;
  recording.rate_Hz = rate_Hz;
  recording.waveforms.resize(presses.size());
  tbb::parallel_for(std::size_t{0}, presses.size(), [&](std::size_t i) {
    const Press& press = presses[i];
    const PressedPiece piece =
        pressed_piece(spec, table, draw_piece(spec, press.material, settings.seed, press.piece), modes);
    const PalpationRun run = play_press(spec, piece, settings.seconds, settings.seed, press.index);
    recording.waveforms[i] = {press.material, press.set, sensor(piece, run, press.index)};
  });
  return recording;
}

}  // namespace

SoftnessSettings SoftnessSettings::chosen() {
  return {sensors::usual_softness_training()};
}

PalpationRecording record_reference(const PalpationSpec& spec, const PalpationTable& table,
                                    const std::vector<std::vector<LumpMode>>& modes,
                                    const PalpationTrialSettings& settings) {
  return record(spec, table, modes, settings, spec.reference.rate_Hz,
                [&](const PressedPiece&, const PalpationRun& run, std::uint64_t index) {
                  return reference_waveform(spec.reference, run, settings.seed, index);
                });
}

PalpationRecording record_vhs(const PalpationSpec& spec, const PalpationTable& table,
                              const std::vector<std::vector<LumpMode>>& modes, const VhsChain& chain,
                              const PalpationTrialSettings& settings) {
  return record(spec, table, modes, settings, chain.frame_rate_Hz,
                [&](const PressedPiece& piece, const PalpationRun& run, std::uint64_t index) {
                  return vhs_waveform(chain, piece.law, run, settings.seed, index);
                });
}

PalpationRecording downsampled(const PalpationRecording& recording, int factor) {
  PalpationRecording slower = recording;
  slower.rate_Hz /= factor;
  for (PalpationWaveform& waveform : slower.waveforms) {
    waveform.force_N = sensors::downsampled(waveform.force_N, factor);
  }
  return slower;
}

SoftnessScore tell_softness(const PalpationSpec& spec, const PalpationRecording& recording,
                            const SoftnessSettings& settings) {
  std::vector<sensors::MaterialSample> samples(recording.waveforms.size());
  std::vector<int> training, validation, test;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const PalpationWaveform& waveform = recording.waveforms[i];
    samples[i].features = sensors::softness_features(waveform.force_N, recording.rate_Hz, settings.spectrogram,
                                                     settings.lowest_Hz, settings.highest_Hz);
    samples[i].label = static_cast<int>(spec.materials.at(static_cast<std::size_t>(waveform.material)).level);
    const bool unseen = settings.unseen_material == waveform.material;
    if (settings.unseen_material && unseen != (waveform.set == PalpationSet::test)) continue;
    (waveform.set == PalpationSet::training     ? training
     : waveform.set == PalpationSet::validation ? validation
                                                : test)
        .push_back(static_cast<int>(i));
  }
  TS_ASSERT(settings.networks > 0);
  std::vector<sensors::MaterialClassifier> networks(static_cast<std::size_t>(settings.networks));
  tbb::parallel_for(0, settings.networks, [&](int n) {
    networks[static_cast<std::size_t>(n)] =
        sensors::train_material_classifier(samples, softness_names(), training, validation, settings.classifier, n)
            .model;
  });
  SoftnessScore score;
  std::vector<int> truth, guesses, of_material;
  std::vector<int> right(spec.materials.size(), 0), all(spec.materials.size(), 0);
  for (const int i : test) {
    const sensors::MaterialSample& sample = samples[static_cast<std::size_t>(i)];
    const int guess = sensors::classify(networks, sample.features).label;
    truth.push_back(sample.label);
    guesses.push_back(guess);
    const auto m = static_cast<std::size_t>(recording.waveforms[static_cast<std::size_t>(i)].material);
    ++all[m];
    right[m] += guess == sample.label;
  }
  score.levels = sensors::confusion_matrix(truth, guesses, kSoftnessLevels);
  for (std::size_t m = 0; m < all.size(); ++m)
    score.right_percent.push_back(all[m] > 0 ? 100.0 * right[m] / all[m] : 0.0);
  return score;
}

}  // namespace touchstone::lab
