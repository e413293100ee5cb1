#pragma once
// Quasi-random numbers for one path: Owen-scrambled [Owen1995] Sobol points [Sobol1967], two dimensions at a time.

#include <array>
#include <cstdint>

namespace touchstone::render {

/// Bit 0 becomes bit 31, and so on.
inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/// A bijective mix of 64 bits (the finaliser of SplitMix64 [Steele2014]).
inline std::uint64_t mix_bits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// A hash in which each bit depends on lower bits only: applied to a bit-reversed number it is an Owen scrambling
/// ([Laine2011], with the constants of [Vegdahl2021]).
inline std::uint32_t hash_upwards(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// The second Sobol dimension of an index, bit-reversed: the Pascal matrix modulo 2 applied to the index (its entry
/// (k, j) is odd just where the bits of k are among those of j).
inline std::uint32_t sobol_second_reversed(std::uint32_t index) {
  index ^= (index & 0xaaaaaaaau) >> 1;
  index ^= (index & 0xccccccccu) >> 2;
  index ^= (index & 0xf0f0f0f0u) >> 4;
  index ^= (index & 0xff00ff00u) >> 8;
  index ^= (index & 0xffff0000u) >> 16;
  return index;
}

/// The numbers of sample `sample` of pixel `pixel`: each call of next_pair() gives the sample's point of another
/// (0,2)-sequence, Owen-scrambled and shuffled on its own (padding [Burley2020]). A pure function of (seed, pixel,
/// sample, number of calls). Values in [0, 1).
class SampleSequence {
 public:
  /// At its first pair.
  SampleSequence(std::uint64_t seed, std::uint64_t pixel, std::uint32_t sample)
      : key_(mix_bits(seed + 0x9e3779b97f4a7c15ull * (pixel + 1))), reversed_sample_(reverse_bits(sample)) {}

  /// A sequence whose numbers are all one half: the deterministic ray of a preview.
  static SampleSequence centre() {
    SampleSequence sequence(0, 0, 0);
    sequence.fixed_ = true;
    return sequence;
  }
  bool is_centre() const { return fixed_; }

  /// Two numbers that are evenly spread over the samples of the pixel.
  std::array<double, 2> next_pair() {
    if (fixed_) return {0.5, 0.5};
    const Point point = advance();
    const std::uint64_t b = mix_bits(point.key ^ 0xd1b54a32d192ed03ull);
    const std::uint32_t y = hash_upwards(sobol_second_reversed(point.index), static_cast<std::uint32_t>(b));
    return {to_unit(point.x), to_unit(y)};
  }

  /// The first number of next_pair().
  double next() { return fixed_ ? 0.5 : to_unit(advance().x); }

 private:
  struct Point {  // bit-reversed
    std::uint64_t key;
    std::uint32_t index, x;
  };
  Point advance() {
    key_ += 0x9e3779b97f4a7c15ull;
    const std::uint64_t key = mix_bits(key_);
    const std::uint32_t index = reverse_bits(hash_upwards(reversed_sample_, static_cast<std::uint32_t>(key)));
    return {key, index, hash_upwards(index, static_cast<std::uint32_t>(key >> 32))};
  }
  static double to_unit(std::uint32_t reversed) { return reverse_bits(reversed) * 0x1.0p-32; }

  std::uint64_t key_;
  std::uint32_t reversed_sample_;
  bool fixed_ = false;
};

}  // namespace touchstone::render
