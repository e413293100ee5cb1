#pragma once
// A force's waveform as a picture of its frequencies over time: what [VisioHaptic2024, sec. 2.3.1] classifies softness
// from
// ("FFT to transform the force sensor waveforms into frequency fluctuated images"). Neither windows nor scale are in
// the paper.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace touchstone::sensors {

/// Where the waveform begins, and how it is cut in windows.
struct ForceSpectrogramSettings {
  double window_s = 0.064;  ///< Hann's, above 0
  double hop_s = 0.032;     ///< from window to window, above 0
  double length_s = 0.768;  ///< of the waveform from where it begins
  double trigger_N = 0.05;  ///< it begins `before_s` before the force first stays above that for kTriggerSamples
  double before_s = 0.032;
  double floor_N = 1e-3;  ///< amplitudes below that look alike: above 0
};

/// Samples in a row above the trigger that are a touch: a single one may be noise.
inline constexpr int kTriggerSamples = 3;

/// The frequencies of a window, from 0 to half the rate, Hz.
Eigen::VectorXd spectrogram_frequencies(double rate_Hz, const ForceSpectrogramSettings& settings);

/// log10 of the amplitude (N, with the floor added) of each frequency (a row) in each window (a column). An amplitude
/// is that of a steady sinusoid; of frequency 0 the mean. Samples beyond the waveform's end are as its last.
/// @param force_N evenly in time at `rate_Hz`
/// @throws Error for settings or a rate out of range, a window of under 4 samples, forces that aren't finite, or a
/// waveform without a touch
Eigen::MatrixXd force_spectrogram(std::span<const double> force_N, double rate_Hz,
                                  const ForceSpectrogramSettings& settings = {});

/// Every `factor`-th sample, the first one first: a waveform of that part of its rate. Nothing is filtered: what lies
/// beyond half the new rate is folded back. @throws Error for a factor below 1
std::vector<double> downsampled(std::span<const double> force_N, int factor);

}  // namespace touchstone::sensors
