#pragma once
// Lengths, signal and noise of a Gaussian process from data: [Naeini2020, sec. III.D and V.C], "Bayesian optimization
// ... over ten iterations"; and, beside it, by the gradient of the evidence.
//
// The paper doesn't say what its optimisation makes small; it tunes "on the validation set". Both that and the evidence
// can be asked for here. Searched are the logarithms of the lengths and of noise / signal; for each the signal follows
// (with_best_signal).

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sensors/learning/gaussian_process.h"

namespace touchstone::sensors {

/// How the process' parameters are searched.
enum class TuningMethod : std::uint8_t {
  kBayesian,  ///< 10 evaluations; the paper's
  kGradient,  ///< of the evidence, by scaled conjugate gradient from the same first place
};
/// What the search makes best.
enum class TuningAim : std::uint8_t {
  kValidation,  ///< least mean squared error on the validation samples; not for kGradient
  kEvidence,    ///< most evidence
};
/// "bayesian", "gradient"; "validation", "evidence"
const char* name_of(TuningMethod method);
const char* name_of(TuningAim aim);

/// What is searched for, where, and with how many samples.
struct TuningSettings {
  TuningMethod method = TuningMethod::kBayesian;
  TuningAim aim = TuningAim::kValidation;
  int evaluations = 10;  ///< of Bayesian optimisation; at least 4
  int gradient_steps = 30;
  /// Of more samples so many, drawn at random, are used while parameters are looked for (the cost grows with their
  /// cube); the process that comes out has all. At least 10.
  int most_samples = 2000;
  double longest = 30.0;             ///< longest length searched, in standard deviations of its input;
                                     ///< the shortest is 1 / longest. Above 1
  double least_noise_ratio = 0.003;  ///< of noise to signal; searched up to 1
  std::uint64_t seed = 1;
};

/// The process with the best parameters, and what the search took.
struct TunedGaussianProcess {
  GaussianProcess process;     ///< of all samples
  int samples_used = 0;        ///< while parameters were looked for
  int factorisations = 0;      ///< then
  std::vector<double> values;  ///< what was made small, of each evaluation: mean squared error, or -evidence / samples
};

/// @param fold which of several tunings it is: each has random numbers of its own
/// @throws Error as condition() does, for a setting out of its range, or for kValidation without validation samples,
/// with samples that don't fit, or with kGradient
TunedGaussianProcess tune_gaussian_process(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& targets,
                                           const Eigen::MatrixXd& validation_inputs,
                                           const Eigen::VectorXd& validation_targets, const TuningSettings& settings,
                                           int fold = 0);

}  // namespace touchstone::sensors
