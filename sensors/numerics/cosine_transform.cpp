#include "sensors/numerics/cosine_transform.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/units.h"
#include "core/wide_clones.h"

namespace touchstone::sensors {
namespace {

// A complex entry of a block: kHalf real parts (the first half of the signals), then kHalf imaginary ones.
constexpr int kHalf = kTransformLanes / 2;
constexpr int kWidth = kTransformLanes;

struct Complex {
  float re, im;
};

inline Complex operator+(Complex a, Complex b) {
  return {a.re + b.re, a.im + b.im};
}
inline Complex operator-(Complex a, Complex b) {
  return {a.re - b.re, a.im - b.im};
}
inline Complex operator*(float s, Complex a) {
  return {s * a.re, s * a.im};
}
inline Complex operator*(Complex a, Complex b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
/// i^-1 a forwards, i a backwards.
template <bool kForward>
inline Complex quarter_turn(Complex a) {
  return kForward ? Complex{a.im, -a.re} : Complex{-a.im, a.re};
}

/// The Fourier transform of kRadix numbers, in place.
template <int kRadix, bool kForward>
inline void small_transform(Complex* x) {
  if constexpr (kRadix == 2) {
    const Complex a = x[0];
    x[0] = a + x[1];
    x[1] = a - x[1];
  } else if constexpr (kRadix == 3) {
    constexpr float kSin = 0.86602540378443864676F;  // sin(2 pi / 3)
    const Complex sum = x[1] + x[2];
    const Complex side = quarter_turn<kForward>(kSin * (x[1] - x[2]));
    const Complex middle = x[0] - 0.5F * sum;
    x[0] = x[0] + sum;
    x[1] = middle + side;
    x[2] = middle - side;
  } else if constexpr (kRadix == 4) {
    const Complex even_sum = x[0] + x[2];
    const Complex even_difference = x[0] - x[2];
    const Complex odd_sum = x[1] + x[3];
    const Complex odd_difference = quarter_turn<kForward>(x[1] - x[3]);
    x[0] = even_sum + odd_sum;
    x[1] = even_difference + odd_difference;
    x[2] = even_sum - odd_sum;
    x[3] = even_difference - odd_difference;
  } else {
    static_assert(kRadix == 5);
    constexpr float kCos1 = 0.30901699437494742410F;   // cos(2 pi / 5)
    constexpr float kCos2 = -0.80901699437494742410F;  // cos(4 pi / 5)
    constexpr float kSin1 = 0.95105651629515357212F;
    constexpr float kSin2 = 0.58778525229247312917F;
    const Complex outer_sum = x[1] + x[4];
    const Complex inner_sum = x[2] + x[3];
    const Complex outer = x[1] - x[4];
    const Complex inner = x[2] - x[3];
    const Complex near = x[0] + kCos1 * outer_sum + kCos2 * inner_sum;
    const Complex far = x[0] + kCos2 * outer_sum + kCos1 * inner_sum;
    const Complex near_side = quarter_turn<kForward>(kSin1 * outer + kSin2 * inner);
    const Complex far_side = quarter_turn<kForward>(kSin2 * outer - kSin1 * inner);
    x[0] = x[0] + outer_sum + inner_sum;
    x[1] = near + near_side;
    x[4] = near - near_side;
    x[2] = far + far_side;
    x[3] = far - far_side;
  }
}

/// One stage: forwards each group of kRadix entries, `rest` apart, is transformed and then turned; backwards turned
/// back and transformed.
template <int kRadix, bool kForward>
inline void butterflies(float* block, int blocks, int rest, const float* twiddles) {
  const long step = static_cast<long>(rest) * kWidth;
  for (int b = 0; b < blocks; ++b) {
    float* const begin = block + b * kRadix * step;
    const float* twiddle = twiddles;
    for (int j = 0; j < rest; ++j, twiddle += 2 * (kRadix - 1)) {
      float* const at = begin + static_cast<long>(j) * kWidth;
#pragma GCC ivdep
      for (int lane = 0; lane < kHalf; ++lane) {
        Complex x[kRadix];
        for (int s = 0; s < kRadix; ++s) x[s] = {at[s * step + lane], at[s * step + lane + kHalf]};
        if constexpr (!kForward) {
          for (int s = 1; s < kRadix; ++s) x[s] = Complex{twiddle[2 * s - 2], -twiddle[2 * s - 1]} * x[s];
        }
        small_transform<kRadix, kForward>(x);
        if constexpr (kForward) {
          for (int s = 1; s < kRadix; ++s) x[s] = Complex{twiddle[2 * s - 2], twiddle[2 * s - 1]} * x[s];
        }
        for (int s = 0; s < kRadix; ++s) {
          at[s * step + lane] = x[s].re;
          at[s * step + lane + kHalf] = x[s].im;
        }
      }
    }
  }
}

template <bool kForward>
TS_WIDE_CLONES void stage_of_2(float* block, int blocks, int rest, const float* twiddles) {
  butterflies<2, kForward>(block, blocks, rest, twiddles);
}
template <bool kForward>
TS_WIDE_CLONES void stage_of_3(float* block, int blocks, int rest, const float* twiddles) {
  butterflies<3, kForward>(block, blocks, rest, twiddles);
}
template <bool kForward>
TS_WIDE_CLONES void stage_of_4(float* block, int blocks, int rest, const float* twiddles) {
  butterflies<4, kForward>(block, blocks, rest, twiddles);
}
template <bool kForward>
TS_WIDE_CLONES void stage_of_5(float* block, int blocks, int rest, const float* twiddles) {
  butterflies<5, kForward>(block, blocks, rest, twiddles);
}

/// A stage of any radix, by its definition.
void stage_of_any(float* block, int radix, int blocks, int rest, const float* twiddles, const float* roots,
                  bool forward) {
  std::vector<Complex> in(static_cast<std::size_t>(radix));
  const long step = static_cast<long>(rest) * kWidth;
  const auto twiddle = [&](int j, int s) -> Complex {
    if (s == 0) return {1.0F, 0.0F};
    const float* const at = twiddles + 2 * (static_cast<long>(j) * (radix - 1) + s - 1);
    return {at[0], forward ? at[1] : -at[1]};
  };
  for (int b = 0; b < blocks; ++b) {
    for (int j = 0; j < rest; ++j) {
      for (int lane = 0; lane < kHalf; ++lane) {
        float* const at = block + b * radix * step + static_cast<long>(j) * kWidth + lane;
        for (int s = 0; s < radix; ++s) {
          in[static_cast<std::size_t>(s)] = {at[s * step], at[s * step + kHalf]};
          if (!forward) in[static_cast<std::size_t>(s)] = twiddle(j, s) * in[static_cast<std::size_t>(s)];
        }
        for (int s = 0; s < radix; ++s) {
          Complex sum = in[0];
          for (int t = 1; t < radix; ++t) {
            const float* const root = roots + 2 * (static_cast<long>(s) * t % radix);
            sum = sum + Complex{root[0], forward ? root[1] : -root[1]} * in[static_cast<std::size_t>(t)];
          }
          if (forward) sum = twiddle(j, s) * sum;
          at[s * step] = sum.re;
          at[s * step + kHalf] = sum.im;
        }
      }
    }
  }
}

template <bool kForward>
void run_stage(float* block, int radix, int blocks, int rest, const float* twiddles, const float* roots) {
  switch (radix) {
    case 2:
      return stage_of_2<kForward>(block, blocks, rest, twiddles);
    case 3:
      return stage_of_3<kForward>(block, blocks, rest, twiddles);
    case 4:
      return stage_of_4<kForward>(block, blocks, rest, twiddles);
    case 5:
      return stage_of_5<kForward>(block, blocks, rest, twiddles);
    default:
      return stage_of_any(block, radix, blocks, rest, twiddles, roots, kForward);
  }
}

std::vector<int> factors_of(int length) {
  std::vector<int> factors;
  for (const int factor : {4, 2, 5, 3}) {
    for (; length % factor == 0; length /= factor) factors.push_back(factor);
  }
  for (int factor = 7; length > 1; factor += 2) {
    for (; length % factor == 0; length /= factor) factors.push_back(factor);
  }
  return factors;
}

/// Terms k and n - k of the two real signals' DCTs, from the complex transform's.
TS_WIDE_CLONES void part_signals(const float* at_k, const float* at_mirror, float cosine, float sine, float* out_k,
                                 float* out_mirror) {
#pragma GCC ivdep
  for (int lane = 0; lane < kHalf; ++lane) {
    const float a = at_k[lane];
    const float b = at_k[lane + kHalf];
    const float c = at_mirror[lane];
    const float d = at_mirror[lane + kHalf];
    const float first_re = 0.5F * (a + c);
    const float first_im = 0.5F * (b - d);
    const float second_re = 0.5F * (b + d);
    const float second_im = 0.5F * (c - a);
    out_k[lane] = first_re * cosine + first_im * sine;
    out_k[lane + kHalf] = second_re * cosine + second_im * sine;
    out_mirror[lane] = first_re * sine - first_im * cosine;
    out_mirror[lane + kHalf] = second_re * sine - second_im * cosine;
  }
}

/// The inverse of part_signals.
TS_WIDE_CLONES void join_signals(const float* at_k, const float* at_mirror, float cosine, float sine, float* out_k,
                                 float* out_mirror) {
#pragma GCC ivdep
  for (int lane = 0; lane < kHalf; ++lane) {
    const float first_re = at_k[lane] * cosine + at_mirror[lane] * sine;
    const float first_im = at_k[lane] * sine - at_mirror[lane] * cosine;
    const float second_re = at_k[lane + kHalf] * cosine + at_mirror[lane + kHalf] * sine;
    const float second_im = at_k[lane + kHalf] * sine - at_mirror[lane + kHalf] * cosine;
    out_k[lane] = first_re - second_im;
    out_k[lane + kHalf] = first_im + second_re;
    out_mirror[lane] = first_re + second_im;
    out_mirror[lane + kHalf] = second_re - first_im;
  }
}

}  // namespace

CosineTransform::CosineTransform(int length) : length_(length) {
  TS_ASSERT(length >= 1);
  const auto size = static_cast<std::size_t>(length);
  source_.resize(size);
  for (int j = 0; j < length; ++j) source_[static_cast<std::size_t>(j)] = 2 * j < length ? 2 * j : 2 * (length - j) - 1;
  int part = length;
  for (const int radix : factors_of(length)) {
    Stage stage;
    stage.radix = radix;
    stage.rest = part / radix;
    stage.blocks = length / part;
    for (int j = 0; j < stage.rest; ++j) {
      for (int s = 1; s < radix; ++s) {
        const double angle = -2.0 * kPi * j * s / part;
        stage.twiddles.push_back(static_cast<float>(std::cos(angle)));
        stage.twiddles.push_back(static_cast<float>(std::sin(angle)));
      }
    }
    for (int s = 0; s < radix; ++s) {
      stage.roots.push_back(static_cast<float>(std::cos(2.0 * kPi * s / radix)));
      stage.roots.push_back(static_cast<float>(-std::sin(2.0 * kPi * s / radix)));
    }
    part = stage.rest;
    stages_.push_back(std::move(stage));
  }
  for (int k = 0; k < length; ++k) {
    int place = 0;
    int rest = k;
    for (const Stage& stage : stages_) {
      place += rest % stage.radix * stage.rest;
      rest /= stage.radix;
    }
    place_.push_back(place);
    const double angle = 0.5 * kPi * k / length;
    turn_.push_back({static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))});
  }
}

void CosineTransform::forward(const float* in, long in_stride, float* work, float* out) const {
  for (int j = 0; j < length_; ++j) {
    std::memcpy(work + static_cast<long>(j) * kWidth, in + source_[static_cast<std::size_t>(j)] * in_stride,
                kWidth * sizeof(float));
  }
  for (const Stage& stage : stages_) {
    run_stage<true>(work, stage.radix, stage.blocks, stage.rest, stage.twiddles.data(), stage.roots.data());
  }
  std::memcpy(out, work, kWidth * sizeof(float));  // term 0 stays at place 0
  for (int k = 1; 2 * k <= length_; ++k) {
    const int mirror = length_ - k;
    const auto [cosine, sine] = turn_[static_cast<std::size_t>(k)];
    part_signals(work + static_cast<long>(place_[static_cast<std::size_t>(k)]) * kWidth,
                 work + static_cast<long>(place_[static_cast<std::size_t>(mirror)]) * kWidth, cosine, sine,
                 out + static_cast<long>(k) * kWidth, out + static_cast<long>(mirror) * kWidth);
  }
}

void CosineTransform::inverse_times_length(const float* in, float* work, float* out, long out_stride) const {
  std::memcpy(work, in, kWidth * sizeof(float));
  for (int k = 1; 2 * k <= length_; ++k) {
    const int mirror = length_ - k;
    const auto [cosine, sine] = turn_[static_cast<std::size_t>(k)];
    join_signals(in + static_cast<long>(k) * kWidth, in + static_cast<long>(mirror) * kWidth, cosine, sine,
                 work + static_cast<long>(place_[static_cast<std::size_t>(k)]) * kWidth,
                 work + static_cast<long>(place_[static_cast<std::size_t>(mirror)]) * kWidth);
  }
  for (auto stage = stages_.rbegin(); stage != stages_.rend(); ++stage) {
    run_stage<false>(work, stage->radix, stage->blocks, stage->rest, stage->twiddles.data(), stage->roots.data());
  }
  for (int j = 0; j < length_; ++j) {
    std::memcpy(out + source_[static_cast<std::size_t>(j)] * out_stride, work + static_cast<long>(j) * kWidth,
                kWidth * sizeof(float));
  }
}

}  // namespace touchstone::sensors
