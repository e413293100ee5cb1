#pragma once

#include <array>
#include <cstdint>

namespace touchstone {

/// What the numbers of a stream are for: two purposes never share numbers.
enum class Purpose : std::uint32_t {
  kPixelSamples = 1,
  kImagerNoise = 2,
  kImagerPattern = 3,
  kPlacement = 4,
  kMotion = 5,
  kEventThreshold = 6,
  kEventNoise = 7,
  kLampSpread = 8,
  kMatchSampling = 9,
  kRelief = 10,
  kGrasp = 11,
  kGraspShake = 12,
  kForceSensor = 13,
  kMembraneWalk = 14,
  kCentroidNoise = 15,
  kDrawnTouch = 16,
  kDrawnUnit = 17,
  kDrawnPiece = 18,
  kSplit = 19,
  kNetworkWeights = 20,
  kFolds = 21,
  kSearch = 22,
  kStudy = 23,
  kHotPixels = 24,
  kTest = 99,
};

/// Counter-based random numbers (Philox4x32-10 [Salmon2011], by the Random123 library): a pure function of (seed,
/// index, purpose) and of how many were drawn before, whatever the thread. It satisfies the standard's
/// UniformRandomBitGenerator.
class RandomStream {
 public:
  /// What the standard asks of a UniformRandomBitGenerator.
  using result_type = std::uint32_t;

  /// The stream of these three; another purpose or index shares no numbers with it.
  RandomStream(std::uint64_t seed, std::uint64_t index, Purpose purpose);

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return 0xffffffffu; }
  /// The next number.
  result_type operator()();

  /// Uniform in [0, 1), of 53 bits.
  double uniform();
  /// Standard normal (Box-Muller).
  double normal();
  /// Poisson of the given mean; above a mean of 1e4 by the rounded normal, which is nearer than 1e-3 standard
  /// deviations there. @pre mean >= 0 and finite
  double poisson(double mean);

 private:
  std::uint64_t seed_;
  std::uint64_t index_;
  std::uint32_t purpose_;
  std::uint32_t counter_ = 0;
  std::array<std::uint32_t, 4> block_{};
  unsigned used_ = 4;
  bool has_spare_normal_ = false;
  double spare_normal_ = 0.0;
};

}  // namespace touchstone
