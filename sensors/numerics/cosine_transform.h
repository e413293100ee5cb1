#pragma once
// The discrete cosine transform of many signals at once, for the Poisson solver.

#include <array>
#include <vector>

namespace touchstone::sensors {

/// Signals that are transformed together: what a block of memory of the transform holds side by side.
inline constexpr int kTransformLanes = 16;

/// DCT-II and its inverse of kTransformLanes real signals of equal length. A block is length * kTransformLanes floats:
/// value j of signal i at [j * kTransformLanes + i].
///
/// A signal's even entries in order and its odd ones backwards have a Fourier transform that is the DCT but for a
/// rotation of each term [Makhoul1980]; two real signals make one complex one. The Fourier transform works in place,
/// with factors 4, 2, 3, 5 and any others; a large prime factor p costs p^2, so lengths such as 241 are slow.
class CosineTransform {
 public:
  /// @pre length >= 1
  explicit CosineTransform(int length);

  int length() const { return length_; }

  /// out[k] = sum_j in[j] cos(pi k (2 j + 1) / (2 length)). `in` row j begins at in + j * in_stride (floats).
  /// `work` and `out` are blocks of their own.
  void forward(const float* in, long in_stride, float* work, float* out) const;
  /// The inverse, times length: out[j] = in[0] + 2 sum_{k>0} in[k] cos(...). `in` is a block, `out` rows of out_stride.
  void inverse_times_length(const float* in, float* work, float* out, long out_stride) const;

 private:
  struct Stage {
    int radix = 0;
    int rest = 0;                 ///< length of each of the `radix` parts
    int blocks = 0;               ///< how many times the stage is repeated along the signal
    std::vector<float> twiddles;  ///< rest x (radix - 1) x {cos, sin}
    std::vector<float> roots;     ///< radix x {cos, sin}, for radices without a form of their own
  };

  int length_;
  std::vector<Stage> stages_;
  std::vector<int> source_;                 ///< which entry of a signal stands at place j before the Fourier transform
  std::vector<int> place_;                  ///< where the Fourier transform leaves term k
  std::vector<std::array<float, 2>> turn_;  ///< {cos, sin}(pi k / (2 length))
};

}  // namespace touchstone::sensors
