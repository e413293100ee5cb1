#pragma once
// The two laws of explore mode: from a picture's dilation to the press, and from the press to the force [Knoop2013,
// eqs. 8 and 1].

#include <array>
#include <cmath>
#include <span>

namespace touchstone::sensors {

/// press = sum_i mm[i] (1 - 1/dilation)^(i+1). The first coefficient is the paper's Z, the distance of the skin at rest
/// (with z counted towards the camera: what comes nearer grows, so dilation = Z/(Z - press)); with `terms` 1 it's
/// eq. 8. Two or three terms also take in that a dome flattens while it comes nearer.
struct DilationPress {
  int terms = 1;  ///< 1 to 3
  std::array<double, 3> mm{};
  double rms_residual_mm = 0.0;

  /// mm; below 0 for a dilation below 1.
  double press_mm(double dilation) const {
    const double nearer = 1.0 - 1.0 / dilation;
    return nearer * (mm[0] + nearer * (mm[1] + nearer * mm[2]));
  }
};

/// One picture at a known press.
struct DilationSample {
  double dilation = 1.0;
  double press_mm = 0.0;
};

/// Least squares in the press. @throws Error for a number of terms other than 1 to 3, fewer samples than three times
/// that, values that aren't finite, a dilation that isn't above 0, or too few different dilations
DilationPress fit_dilation_press(std::span<const DilationSample> samples, int terms = 1);

/// force = scale_N (exp(rate_per_mm press) - 1), eq. 1. Below no press there is no force.
struct ExponentialForce {
  double scale_N = 0.0;
  double rate_per_mm = 0.0;
  double rms_residual_N = 0.0;

  double force_N(double press_mm) const { return press_mm > 0.0 ? scale_N * std::expm1(rate_per_mm * press_mm) : 0.0; }
};

/// One known press with its force.
struct PressSample {
  double press_mm = 0.0;
  double force_N = 0.0;
};

/// Least squares in the force, over both figures. @throws Error for fewer than 4 samples, values that aren't finite,
/// fewer than two different presses above 0, or samples that no law with a rate of 0.001/mm to 10/mm fits better than
/// its neighbours (as forces that fall with the press)
ExponentialForce fit_exponential_force(std::span<const PressSample> samples);

}  // namespace touchstone::sensors
