#pragma once
// The first stage of an event pixel: the logarithm of the photocurrent, and the low-pass of the photoreceptor. All is
// free of branches, so that compilers turn a loop over pixels into vector code.
//
// Levels are base-2 logarithms in fixed point, 32 bits with 24 after the point: sums and differences of them are exact,
// so that nothing drifts however many frames a sequence has, and the ramp of a level and its mirror image give
// mirrored events.

#include <bit>
#include <cstdint>
#include <numbers>

namespace touchstone::render {

inline constexpr double kLevelPerLog2 = 16777216.0;                          ///< 2^24
inline constexpr double kLevelPerLog = kLevelPerLog2 * std::numbers::log2e;  ///< levels of a natural logarithm of 1
/// Levels of photocurrents up to this are far from overflow, also as differences.
inline constexpr double kLargestPhotocurrent = 0x1.0p60;

/// log2(photocurrent) as a level, off by less than 2e-7 (in log2) besides the rounding of `photocurrent` itself.
/// By the series of the area tangent: with m = 2^-e photocurrent between sqrt(1/2) and sqrt(2) and s = (m-1)/(m+1),
/// log2 m = 2/ln 2 (s + s^3/3 + s^5/5 + ...), cut after s^9, which leaves less than 2e-9. @pre a positive normal number
inline std::int32_t level_of(float photocurrent) {
  constexpr std::int32_t kRootOfHalf = 0x3f3504f3;
  const auto bits = std::bit_cast<std::int32_t>(photocurrent);
  const std::int32_t exponent = (bits - kRootOfHalf) >> 23;
  const auto m = std::bit_cast<float>(bits - (exponent << 23));
  const float s = (m - 1.0F) / (m + 1.0F);
  const float z = s * s;
  const float series = 1.0F + z * (1.0F / 3.0F + z * (1.0F / 5.0F + z * (1.0F / 7.0F + z * (1.0F / 9.0F))));
  constexpr auto kScale = static_cast<float>(2.0 * kLevelPerLog);
  return (exponent << 24) + static_cast<std::int32_t>(kScale * s * series);
}

/// How far a first-order low-pass goes in a time in which the integral of its rate is E: `gone` = 1 - exp(-E), and
/// `mean_left` = gone / E, the mean over the time of what is left of a step.
struct Relaxation {
  float gone = 0.0F;
  float mean_left = 1.0F;
};

/// The E that relaxation() takes: beyond these bounds nothing changes in the last digit of a float. A function of its
/// own, for a loop of its own: compilers make two branches of one that begins with a clamp, and no vector code of that.
inline float relaxation_exponent(float e) {
  const float positive = e > 1e-30F ? e : 1e-30F;
  return positive < 80.0F ? positive : 80.0F;
}

/// Relative errors below 1e-6. @pre e comes from relaxation_exponent
inline Relaxation relaxation(float e) {
  const auto n = static_cast<std::int32_t>(e * static_cast<float>(std::numbers::log2e) + 0.5F);
  const float y = static_cast<float>(n) * static_cast<float>(std::numbers::ln2) - e;  // at most ln(2)/2 up or down
  // exp(y) - 1 by Taylor's series: a small E keeps all its digits.
  const float q =
      y * (1.0F +
           y * (1.0F / 2 + y * (1.0F / 6 + y * (1.0F / 24 + y * (1.0F / 120 + y * (1.0F / 720 + y * (1.0F / 5040)))))));
  const auto power = std::bit_cast<float>((127 - n) << 23);
  const float gone = (1.0F - power) - power * q;
  return {gone, gone / e};
}

}  // namespace touchstone::render
