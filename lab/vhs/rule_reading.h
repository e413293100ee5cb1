#pragma once
// Reading the divisions of a rule from brightness along it.

#include <optional>
#include <vector>

namespace touchstone::lab {

/// Brightness along a rule at even steps.
struct RuleProfile {
  double from_mm = 0.0;  ///< of the first value
  double step_mm = 0.0;
  std::vector<double> values;

  double length_mm() const { return step_mm * static_cast<double>(values.size()); }
};

/// What is read without knowing the pitch.
struct RuleReading {
  double lines_per_mm = 0.0;  ///< of the strongest wave between the slowest and the fastest that are looked for
  double contrast = 0.0;      ///< its amplitude, as part of the mean
  double noise = 0.0;         ///< the median amplitude of the other waves, likewise
  double dark_mm = 0.0;       ///< a place where it is darkest, the first one from from_mm on
};

/// The strongest wave from `slowest` to `fastest` per mm, after unevenness (a parabola) is divided out, under a Hann
/// window.
RuleReading read_rule(const RuleProfile& profile, double slowest, double fastest);

/// Amplitude of one wave, as part of the mean: how much of a printed contrast is left, by least squares over whole
/// periods. Its sign is that of the brightness between the lines, where a line's middle is at `line_mm`: positive where
/// lines are dark.
double contrast_at(const RuleProfile& profile, double lines_per_mm, double line_mm);

/// Are the divisions read? The strongest wave stands `kClear` times above the noise, it counts as many lines as there
/// are, and dark is where lines are, to within a quarter of a division.
bool reads(const RuleReading& reading, const RuleProfile& profile, double true_pitch_mm, double line_mm);

/// Of read_rule's median noise: of 200 waves of noise alone the strongest comes to that once in a thousand times
/// (Rayleigh's distribution).
inline constexpr double kClearWave = 4.2;

}  // namespace touchstone::lab
