#pragma once
// How exact light is made: what a scene says of it, and what its accuracy says.

#include <optional>
#include <string>

namespace touchstone::sim {

struct SceneSpec;

/// At most so many paths a pixel where neither a scene's `light` nor an `accuracy` says otherwise.
inline constexpr int kUsualMaxSamples = 64;
/// The same where an accuracy says how exact light has to be. With 4096 a picture of `gelsight-dome` took more than
/// twenty minutes, where direct light is nearer at a second: who wants so many says so in `light`.
inline constexpr int kMostPathsByNeed = 256;

/// How exact a scene's light is made: what its block `light` says, and what that leaves open.
struct LightLimits {
  double noise_fraction = 1.0;  ///< a pixel is sampled until its standard error is this part of the imager's noise
  /// Before the first look at a pixel's error; 8 are judged by two blocks of 4, which are alike by luck where a pixel
  /// has a print's edge: there pictures of the reflex device were 2.7 of the imager's noise off instead of 1 (of 32:
  /// 0.7).
  int min_samples = 32;
  int max_samples = kUsualMaxSamples;
  double direct_tolerance = 0.015;  ///< RMS difference from path tracing that direct light may have, relative
  /// The same over the imager's noise in each pixel, which counts instead where it's there.
  std::optional<double> direct_noise;
};

/// What is left open follows `accuracy.pixel_noise` where the scene or its device states an accuracy: half of the
/// variance that is allowed goes to how light is made, to the noise of paths, with as many paths as that takes (up to
/// kMostPathsByNeed), or to what direct light is off.
LightLimits light_limits(const SceneSpec& scene);

/// What direct light may be off, as "1.5 %" or "0.71 of the imager's noise".
std::string direct_limit_in_words(const LightLimits& limits);

}  // namespace touchstone::sim
