#pragma once
// How soft a pressed piece is, from a press's force over time: [VisioHaptic2024, sec. 2.3.1] by small networks on the
// spectrogram's numbers, and their file.

#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sensors/events/material_classifier.h"
#include "sensors/skin/force_spectrogram.h"

namespace touchstone::sensors {

/// Which part of the spectrogram the networks see, and how they are trained.
struct SoftnessTraining {
  ForceSpectrogramSettings spectrogram;
  double highest_Hz = 0.0;  ///< rows of the picture above are left out; 0: none
  double lowest_Hz = 0.0;   ///< rows below are left out
  MaterialClassifierSettings classifier;
  int networks = 5;  ///< whose probabilities are averaged
};
/// One hidden layer of 10 units, of 10, 20 and 40 the best on seeds 901 and 902 of the palpation experiment, which no
/// row of validation uses. Forces above the vhs sensor's noise begin a waveform.
SoftnessTraining usual_softness_training();

/// A calibrated model of one sensor.
struct SoftnessModel {
  double rate_Hz = 0.0;  ///< of the waveforms
  ForceSpectrogramSettings spectrogram;
  double highest_Hz = 0.0, lowest_Hz = 0.0;  ///< as of SoftnessTraining
  std::vector<MaterialClassifier> networks;  ///< of the same names
};

/// What the networks see of a waveform. @throws Error as force_spectrogram, or for a band without a row
Eigen::VectorXd softness_features(std::span<const double> force_N, double rate_Hz,
                                  const ForceSpectrogramSettings& spectrogram, double lowest_Hz, double highest_Hz);

/// The mean of the networks' probabilities. @pre at least one @throws Error as classify
MaterialGuess classify(std::span<const MaterialClassifier> networks, const Eigen::VectorXd& features);

/// A press of a piece of known softness.
struct KnownSoftness {
  std::vector<double> force_N;  ///< evenly in time
  std::string softness;         ///< the name of its level
};

/// A model, and how it does.
struct SoftnessCalibration {
  SoftnessModel model;
  int right = 0;  ///< presses named right by networks of all others
};
/// @param threads 0: as many as the machine has; results are the same
/// @throws Error for a level with fewer than three presses, one level alone, and as the trainers
SoftnessCalibration calibrate_softness(std::span<const KnownSoftness> presses, double rate_Hz,
                                       const SoftnessTraining& training, int threads = 0);

/// The level of one press. @throws Error as softness_features
MaterialGuess classify(const SoftnessModel& model, std::span<const double> force_N);

/// What is wrong with it; empty if nothing is.
std::string fault_of(const SoftnessModel& model);

/// JSON with a checksum (format "touchstone.softness_model", version 1). @throws Error for a model with a fault
std::string to_json(const SoftnessModel& model);
/// @throws Error naming file and field, for what isn't such a file, is damaged, or holds a model with a fault
SoftnessModel softness_model_from_json(const std::string& text, const std::string& name);

/// Writes the file whole or not at all.
void save(const SoftnessModel& model, const std::filesystem::path& path);
/// @throws Error as softness_model_from_json, or if the file can't be read
SoftnessModel load_softness_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
