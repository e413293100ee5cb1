#include "sensors/image/grey_pixels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>

#include "core/wide_clones.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#endif

namespace touchstone::sensors {

namespace {

// OpenCV's weights of blue, green and red, in 1/2^15.
constexpr int kBlue = 3735;
constexpr int kGreen = 19235;
constexpr int kRed = 9798;
constexpr int kWeightBits = 15;
constexpr int kHalf = 1 << (kWeightBits - 1);

void grey_plain(const std::uint8_t* bgr, int count, std::uint8_t* grey) {
  for (int i = 0; i < count; ++i, bgr += 3) {
    const int sum = kBlue * bgr[0] + kGreen * bgr[1] + kRed * bgr[2] + kHalf;
    grey[i] = static_cast<std::uint8_t>(sum >> kWeightBits);
  }
}

#if defined(__x86_64__) && defined(__GNUC__)

constexpr int kBlock = 16;  // pixels that are read together

/// Of kBlock pixels, eight at a time: those of 24 bytes, of which 12 stand in each half of a vector, `skip` bytes from
/// the half's begin.
template <int skip>
[[gnu::target("avx2"), gnu::always_inline]] inline __m256i grey_of_eight(__m256i bgr) {
  constexpr char kNone = -1;  // zero
  const __m256i blue_green =
      _mm256_broadcastsi128_si256(_mm_setr_epi8(skip, kNone, skip + 1, kNone, skip + 3, kNone, skip + 4, kNone,
                                                skip + 6, kNone, skip + 7, kNone, skip + 9, kNone, skip + 10, kNone));
  const __m256i red =
      _mm256_broadcastsi128_si256(_mm_setr_epi8(skip + 2, kNone, kNone, kNone, skip + 5, kNone, kNone, kNone, skip + 8,
                                                kNone, kNone, kNone, skip + 11, kNone, kNone, kNone));
  // Sums of products of 16-bit pairs: kBlue blue + kGreen green, and kRed red + kHalf * 1.
  const __m256i weights = _mm256_set1_epi32(kGreen << 16 | kBlue);
  const __m256i red_weights = _mm256_set1_epi32(kHalf << 16 | kRed);
  const __m256i red_one = _mm256_or_si256(_mm256_shuffle_epi8(bgr, red), _mm256_set1_epi32(1 << 16));
  const __m256i sum = _mm256_add_epi32(_mm256_madd_epi16(_mm256_shuffle_epi8(bgr, blue_green), weights),
                                       _mm256_madd_epi16(red_one, red_weights));
  return _mm256_srli_epi32(sum, kWeightBits);
}

[[gnu::target("avx2"), gnu::always_inline]] inline __m256i halves(const std::uint8_t* low, const std::uint8_t* high) {
  const __m128i first = _mm_loadu_si128(reinterpret_cast<const __m128i*>(low));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(first), _mm_loadu_si128(reinterpret_cast<const __m128i*>(high)),
                                 1);
}

[[gnu::target("avx2")]] void grey_avx2(const std::uint8_t* bgr, std::uint8_t* grey) {
  // Pixels 0..3 and 4..7, 8..11 and 12..15; nothing behind the block is read.
  const __m256i first = grey_of_eight<0>(halves(bgr, bgr + 12));
  const __m256i second = grey_of_eight<4>(halves(bgr + 20, bgr + 32));
  const __m256i words = _mm256_permute4x64_epi64(_mm256_packus_epi32(first, second), 0b11011000);  // in order again
  const __m128i bytes = _mm_packus_epi16(_mm256_castsi256_si128(words), _mm256_extracti128_si256(words, 1));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(grey), bytes);
}

#endif

/// Sums of a row's values by their place in it, modulo a multiple of 1 and of 3 channels.
template <typename Value>
struct LaneSums {
  static constexpr std::size_t kLanes = 96 / sizeof(Value);
  std::array<std::uint64_t, kLanes> sums{};
};

/// Adds rows of `count` values, `row_step` values apart. `Wide` has twice a value's bits: it is read as two values at
/// once, whose sums are held apart.
template <typename Value, typename Wide>
[[gnu::always_inline]] inline void add_rows(const Value* row, std::ptrdiff_t row_step, int rows, int count,
                                            LaneSums<Value>& to) {
  static_assert(sizeof(Wide) == 2 * sizeof(Value) && std::endian::native == std::endian::little);
  typedef Wide Pairs __attribute__((vector_size(32)));
  constexpr int kLanes = static_cast<int>(LaneSums<Value>::kLanes);
  constexpr int kBits = std::numeric_limits<Value>::digits;
  constexpr Wide kFirst = std::numeric_limits<Value>::max();
  constexpr int kMost = std::numeric_limits<Value>::max();  // so many of the largest values fit
  constexpr int kAhead = 8;                                 // rows lie apart: nobody else fetches the next ones
  Pairs first[3] = {}, second[3] = {};
  int held = 0;
  const int blocks = count / kLanes;
  const auto rest = static_cast<std::size_t>(count - blocks * kLanes);
  std::array<Value, LaneSums<Value>::kLanes> last{};  // what doesn't fill a block, and zeros
  for (; rows > 0; --rows, row += row_step) {
    if (rows > kAhead) {
      for (int i = 0; i < count; i += 64 / sizeof(Value)) __builtin_prefetch(row + kAhead * row_step + i);
    }
    std::copy_n(row + static_cast<std::ptrdiff_t>(blocks) * kLanes, rest, last.begin());
    for (int b = 0; b <= blocks;) {
      for (const int end = std::min(blocks + 1, b + kMost - held); b < end; ++b, ++held) {
        const Value* in = b < blocks ? row + static_cast<std::ptrdiff_t>(b) * kLanes : last.data();
        for (int k = 0; k < 3; ++k) {
          Pairs pairs;
          std::memcpy(&pairs, in + k * kLanes / 3, sizeof(pairs));
          first[k] += pairs & kFirst;
          second[k] += pairs >> kBits;
        }
      }
      if (held < kMost && rows > 1) continue;
      for (int lane = 0; lane < kLanes; ++lane) {
        const int k = 3 * lane / kLanes;
        const int pair = lane % (kLanes / 3) / 2;
        to.sums[static_cast<std::size_t>(lane)] += lane % 2 == 0 ? first[k][pair] : second[k][pair];
      }
      for (int k = 0; k < 3; ++k) first[k] = second[k] = Pairs{};
      held = 0;
    }
  }
}

TS_WIDE_CLONES void add_bytes(const std::uint8_t* row, std::ptrdiff_t row_step, int rows, int count,
                              LaneSums<std::uint8_t>& to) {
  add_rows<std::uint8_t, std::uint16_t>(row, row_step, rows, count, to);
}
TS_WIDE_CLONES void add_words(const std::uint16_t* row, std::ptrdiff_t row_step, int rows, int count,
                              LaneSums<std::uint16_t>& to) {
  add_rows<std::uint16_t, std::uint32_t>(row, row_step, rows, count, to);
}

template <typename Value, typename Add>
double mean_of(const cv::Mat& image, const cv::Rect& part, Add add) {
  const int channels = image.channels();
  LaneSums<Value> lanes;
  add(image.ptr<Value>(part.y) + channels * part.x, static_cast<std::ptrdiff_t>(image.step1()), part.height,
      channels * part.width, lanes);
  std::array<double, 3> mean{};
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels); ++channel) {
    std::uint64_t sum = 0;
    for (std::size_t i = channel; i < lanes.sums.size(); i += static_cast<std::size_t>(channels)) sum += lanes.sums[i];
    mean[channel] = static_cast<double>(sum) * (1.0 / part.area());
  }
  if (channels == 1) return mean[0];
  return (kBlue * mean[0] + kGreen * mean[1] + kRed * mean[2]) / (1 << kWeightBits);
}

}  // namespace

void grey_of_bgr(const std::uint8_t* bgr, int count, std::uint8_t* grey) {
#if defined(__x86_64__) && defined(__GNUC__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2 && count >= kBlock) {
    for (int i = 0; i + kBlock <= count; i += kBlock) grey_avx2(bgr + 3 * i, grey + i);
    const int last = count - kBlock;  // the last pixels with some that are done already, if they don't fill a block
    if (count % kBlock != 0) grey_avx2(bgr + 3 * last, grey + last);
    return;
  }
#endif
  grey_plain(bgr, count, grey);
}

int grey_of_bgr(const std::uint16_t* pixel) {
  // 16-bit values times 15-bit weights need 31 bits and their sum exactly 32 at most: unsigned holds it.
  const auto sum = static_cast<unsigned>(kBlue) * pixel[0] + static_cast<unsigned>(kGreen) * pixel[1] +
                   static_cast<unsigned>(kRed) * pixel[2];
  return static_cast<int>((sum + kHalf) >> kWeightBits);
}

double mean_grey(const cv::Mat& image, const cv::Rect& part) {
  return image.depth() == CV_8U ? mean_of<std::uint8_t>(image, part, add_bytes)
                                : mean_of<std::uint16_t>(image, part, add_words);
}

}  // namespace touchstone::sensors
