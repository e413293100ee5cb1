#pragma once
// Regression by a Gaussian process: [Naeini2020, sec. III.D, eq. 4], with inputs ON and OFF counts and time.
//
// k(x, x') = signal^2 exp(-1/2 sum over m of ((x_m - x'_m) / length_m)^2): eq. 4, whose print has lost the square of
// the differences. To this come noise^2 on the diagonal and a constant mean, the targets' own (the paper names neither,
// and no force can be regressed without the first). All by Cholesky [Rasmussen2006, algorithm 2.1, eq. 5.9].

#include <Eigen/Core>
#include <cstdint>
#include <string>

namespace touchstone::sensors {

/// Standard deviations and lengths, in the units of targets and inputs; all above 0.
struct GaussianProcessParameters {
  Eigen::VectorXd lengths;  ///< one an input
  double signal = 1.0;      ///< sigma_f
  double noise = 0.1;       ///< sigma_n

  /// Logarithms: of the lengths, the signal, the noise.
  Eigen::VectorXd logarithms() const;
  /// The inverse of logarithms().
  static GaussianProcessParameters from_logarithms(const Eigen::VectorXd& logarithms);
};

/// What it was given, and what follows from it.
struct GaussianProcess {
  GaussianProcessParameters parameters;
  Eigen::MatrixXd inputs;     ///< a sample a row
  Eigen::VectorXd targets;    ///< of each sample
  double mean = 0.0;          ///< of the targets
  Eigen::VectorXd weights;    ///< (K + noise^2 I)^-1 (targets - mean)
  Eigen::MatrixXd factor;     ///< lower triangular, of K + noise^2 I: 8 bytes for each two samples
  double log_evidence = 0.0;  ///< log p(targets | inputs, parameters)
};

/// More samples than this are refused: the factor alone would take 3.2 GB.
inline constexpr Eigen::Index kMostGaussianProcessSamples = 20'000;

/// Takes samples^3 / 3 multiplications: 1848 samples 0.1 to 0.2 s, 7000 5 to 10 s a core, by processor.
/// @throws Error for no or too many samples, sizes that don't fit, a value that isn't finite, parameters that aren't
/// above 0, or a noise so small that rounding leaves no factor, or none that is good to a percent (of samples that
/// repeat each other: below some 1e-6 of the signal)
GaussianProcess condition(const GaussianProcessParameters& parameters, const Eigen::MatrixXd& inputs,
                          const Eigen::VectorXd& targets);

/// Derivatives of the log evidence by the logarithms of the parameters. Five times as long as condition().
Eigen::VectorXd evidence_gradient(const GaussianProcess& process);

/// The signal (and with it the noise, their ratio kept) that has the most evidence for these lengths and this ratio:
/// its square is (targets - mean)^T (K + noise^2 I)^-1 (targets - mean) / samples, times the square of what it was.
/// @returns the same process with those; nothing is factorised again. Targets that are all the same leave it as it is
GaussianProcess with_best_signal(GaussianProcess process);

/// Means at places (a row each). As many exponentials as samples, each.
/// @throws Error for another number of inputs than the process has, or one that isn't finite
Eigen::VectorXd predict(const GaussianProcess& process, const Eigen::MatrixXd& places);

/// One entry for each place asked for.
struct GaussianProcessPrediction {
  Eigen::VectorXd mean;
  /// Of the function itself, squared standard deviation; what would be measured has noise^2 more. At least 0.
  Eigen::VectorXd variance;
};

/// Means and variances; samples^2 / 2 multiplications a place. @throws Error as predict()
GaussianProcessPrediction predict_with_variance(const GaussianProcess& process, const Eigen::MatrixXd& places);

}  // namespace touchstone::sensors
