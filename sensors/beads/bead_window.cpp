#include "sensors/beads/bead_window.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/core.hpp>
#include <span>

#include "core/error.h"
#include "core/wide_clones.h"
#include "sensors/image/grey_pixels.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace touchstone::sensors {

namespace {

std::uint8_t to_level(double value) {
  return static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
}

/// Levels that are their own.
constexpr LevelTable identity() {
  LevelTable table{};
  for (std::size_t v = 0; v < table.size(); ++v) table[v] = static_cast<std::uint8_t>(v);
  return table;
}
constexpr LevelTable kSameLevels = identity();

constexpr std::size_t kMostValues = 256;

using GreyCounts = std::array<std::uint16_t, 256>;  // a window has at most 64 x 64 pixels

GreyCounts count_greys(const GreyWindow& window) {
  // Four histograms in turn, so that equal neighbours don't wait for each other's increment.
  std::array<GreyCounts, 4> part{};
  const std::size_t pixels = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  std::size_t i = 0;
  for (; i + 8 <= pixels; i += 8) {
    std::uint64_t eight;
    std::memcpy(&eight, &window.grey[i], sizeof(eight));
    for (std::size_t k = 0; k < 8; ++k) ++part[k % 4][(eight >> (8 * k)) & 255u];
  }
  for (; i < pixels; ++i) ++part[0][window.grey[i]];
  GreyCounts counts;
  for (std::size_t v = 0; v < counts.size(); ++v) {
    counts[v] = static_cast<std::uint16_t>(part[0][v] + part[1][v] + part[2][v] + part[3][v]);
  }
  return counts;
}

/// Bit v % 64 of word v / 64 is set where the grey value v occurs.
std::array<std::uint64_t, 4> occurring(const GreyCounts& counts) {
  std::array<std::uint64_t, 4> words{};
  for (std::size_t v = 0; v < counts.size(); v += 16) {
#if defined(__SSE2__)
    const auto* eight = reinterpret_cast<const __m128i*>(&counts[v]);
    const __m128i zero = _mm_setzero_si128();
    const __m128i absent = _mm_packs_epi16(_mm_cmpeq_epi16(_mm_loadu_si128(eight), zero),
                                           _mm_cmpeq_epi16(_mm_loadu_si128(eight + 1), zero));
    const std::uint64_t present = ~static_cast<unsigned>(_mm_movemask_epi8(absent)) & 0xffffu;
#else
    std::uint64_t present = 0;
    for (std::size_t i = 0; i < 16; ++i) present |= static_cast<std::uint64_t>(counts[v + i] != 0 ? 1 : 0) << i;
#endif
    words[v / 64] |= present << (v % 64);
  }
  return words;
}

/// What a window's grey values become in step iv, and how they're spread: only contrasts that occur have an entry, from
/// the lowest to the highest. Contrast rises with the grey value, or falls where beads are dark.
struct Contrasts {
  std::size_t size = 0;
  std::array<ValueCount, 256> histogram;       ///< of the contrast values
  std::array<std::int64_t, 256> pixels_up_to;  ///< in this entry and those before
  std::array<std::int64_t, 256> levels_up_to;  ///< sum of these pixels' levels
  std::array<std::uint8_t, 256> first_grey;    ///< of the entry's grey values the one nearest to the entry before
  std::array<std::uint8_t, 256> of_grey;       ///< contrast of each grey value that occurs
  std::span<const ValueCount> from(std::size_t first) const { return {histogram.data() + first, size - first}; }
};

Contrasts contrasts_of(const GreyWindow& window, BeadPolarity polarity, double factor) {
  const LevelTable& levels = window.levels ? *window.levels : kSameLevels;
  const GreyCounts counts = count_greys(window);
  std::array<std::uint8_t, 256> greys;  // those that occur, rising
  std::size_t number = 0;
  std::int64_t sum = 0;
  const std::array<std::uint64_t, 4> words = occurring(counts);
  for (std::size_t word = 0; word < words.size(); ++word) {
    for (std::uint64_t left = words[word]; left != 0; left &= left - 1) {
      const std::size_t v = 64 * word + static_cast<std::size_t>(std::countr_zero(left));
      sum += static_cast<std::int64_t>(levels[v]) * counts[v];
      greys[number++] = static_cast<std::uint8_t>(v);
    }
  }
  const double mean = static_cast<double>(sum) / (window.width * window.height);
  const bool dark = polarity == BeadPolarity::kDark;
  const double sign = dark ? -factor : factor;
  Contrasts result;
  std::int64_t pixels = 0, level_sum = 0;
  for (std::size_t i = 0; i < number; ++i) {
    const std::uint8_t grey = greys[dark ? number - 1 - i : i];
    const int level = levels[grey];
    const int count = counts[grey];
    const std::uint8_t contrast = to_level(sign * (level - mean));
    result.of_grey[grey] = contrast;
    if (result.size == 0 || result.histogram[result.size - 1].value != contrast) {
      result.histogram[result.size] = {contrast, 0};
      result.first_grey[result.size] = grey;
      ++result.size;
    }
    result.histogram[result.size - 1].count += count;
    result.pixels_up_to[result.size - 1] = pixels += count;
    result.levels_up_to[result.size - 1] = level_sum += static_cast<std::int64_t>(level) * count;
  }
  return result;
}

/// Difference of the mean levels of the entries first..last_low and of those behind.
double class_difference(const Contrasts& contrasts, std::size_t first, std::size_t last_low) {
  const std::int64_t pixels_before = first > 0 ? contrasts.pixels_up_to[first - 1] : 0;
  const std::int64_t levels_before = first > 0 ? contrasts.levels_up_to[first - 1] : 0;
  const std::int64_t low = contrasts.pixels_up_to[last_low] - pixels_before;
  const std::int64_t high = contrasts.pixels_up_to[contrasts.size - 1] - contrasts.pixels_up_to[last_low];
  if (low == 0 || high == 0) return 0.0;
  const std::int64_t low_sum = contrasts.levels_up_to[last_low] - levels_before;
  const std::int64_t high_sum = contrasts.levels_up_to[contrasts.size - 1] - contrasts.levels_up_to[last_low];
  return std::abs(static_cast<double>(high_sum) / static_cast<double>(high) -
                  static_cast<double>(low_sum) / static_cast<double>(low));
}

/// Bit x is set where low <= grey[x] <= high. Reads 64 values, or `width` where vectors aren't known.
std::uint64_t bits_in_range(const std::uint8_t* grey, std::size_t width, std::uint8_t low, std::uint8_t high) {
  std::uint64_t row = 0;
#if defined(__SSE2__)
  const __m128i from = _mm_set1_epi8(static_cast<char>(low));
  const __m128i reach = _mm_set1_epi8(static_cast<char>(high - low));
  for (std::size_t x = 0; x < width; x += 16) {
    const __m128i above = _mm_sub_epi8(_mm_loadu_si128(reinterpret_cast<const __m128i*>(grey + x)), from);
    const int inside = _mm_movemask_epi8(_mm_cmpeq_epi8(_mm_min_epu8(above, reach), above));
    row |= static_cast<std::uint64_t>(static_cast<unsigned>(inside)) << x;
  }
#else
  for (std::size_t x = 0; x < width; ++x) {
    row |= static_cast<std::uint64_t>(grey[x] >= low && grey[x] <= high ? 1 : 0) << x;
  }
#endif
  return row;
}

/// One bit a pixel: set where the contrast is in an entry behind `last_low`. @pre there is one
void binarise(const GreyWindow& window, const Contrasts& contrasts, std::size_t last_low, BeadPolarity polarity,
              BitWindow& bits) {
  // Contrast is monotonic in the grey value, so the bead's values are one range of them.
  const std::uint8_t edge = contrasts.first_grey[last_low + 1];
  const bool dark = polarity == BeadPolarity::kDark;
  bits.width = window.width;
  bits.height = window.height;
  const auto width = static_cast<std::size_t>(window.width);
  const std::uint64_t full = bits.full_row();
  const std::uint8_t* in = window.grey.data();  // its 64 x 64 values hold 64 from each row's first one on
  for (int y = 0; y < window.height; ++y, in += width) {
    const std::uint64_t row = bits_in_range(in, width, dark ? 0 : edge, dark ? edge : 255);
    bits.rows[static_cast<std::size_t>(y)] = row & full;
  }
}

/// For each entry but the last the variance between it and those before, and those behind, times the squared count:
/// n1 n2 (m1 - m2)^2 with one division. `counts` and `sums` are of the entries up to each one.
TS_WIDE_CLONES void variances_between(const double* counts, const double* sums, int entries, double* between) {
  const double count = counts[entries - 1];
  const double sum = sums[entries - 1];
  for (int i = 0; i + 1 < entries; ++i) {
    const double difference = sums[i] * count - sum * counts[i];
    between[i] = difference * difference / (counts[i] * (count - counts[i]));
  }
}

bool touches_border(const BitWindow& region) {
  const std::uint64_t last = std::uint64_t{1} << (region.width - 1);
  std::uint64_t all = 0;
  for (int y = 0; y < region.height; ++y) all |= region.rows[static_cast<std::size_t>(y)];
  return (all & 1u) != 0 || (all & last) != 0 || region.rows[0] != 0 ||
         region.rows[static_cast<std::size_t>(region.height - 1)] != 0;
}

/// Centroid with each pixel weighted by the part of it that the bead covers, judged by where its contrast lies between
/// the background's and the bead's. Only pixels within 2 px of the region count.
Eigen::Vector2d weighted_centroid(const GreyWindow& window, const Contrasts& contrasts, const BitWindow& region,
                                  std::size_t last_low, const Eigen::Vector2d& fallback) {
  double bead_sum = 0.0, bead_count = 0.0, back_sum = 0.0, back_count = 0.0;
  for (std::size_t i = 0; i < contrasts.size; ++i) {
    const double count = contrasts.histogram[i].count;
    (i > last_low ? bead_sum : back_sum) += count * contrasts.histogram[i].value;
    (i > last_low ? bead_count : back_count) += count;
  }
  const double bead = bead_sum / bead_count;
  const double back = back_sum / back_count;
  BitWindow near = region;
  dilate(near, 2);
  double weight_sum = 0.0, x_sum = 0.0, y_sum = 0.0;
  for (int y = 0; y < near.height; ++y) {
    for (std::uint64_t bits = near.rows[static_cast<std::size_t>(y)]; bits != 0; bits &= bits - 1) {
      const int x = std::countr_zero(bits);
      const std::uint8_t grey = window.grey[static_cast<std::size_t>(y * window.width + x)];
      const double weight = std::clamp((contrasts.of_grey[grey] - back) / (bead - back), 0.0, 1.0);
      weight_sum += weight;
      x_sum += weight * x;
      y_sum += weight * y;
    }
  }
  if (weight_sum <= 0.0) return fallback;
  return {x_sum / weight_sum + 0.5, y_sum / weight_sum + 0.5};
}

}  // namespace

void BrightnessScale::set(double factor) {
  factor_ = factor;
  for (std::size_t v = 0; v < table_.size(); ++v) table_[v] = to_level(factor * static_cast<double>(v));
}

void BrightnessScale::read(const cv::Mat& image, int x, int y, int stride, int count, std::uint8_t* out) const {
  switch (image.type()) {
    case CV_8UC1: {
      const std::uint8_t* in = image.ptr<std::uint8_t>(y) + x;
      if (stride == 1) {
        std::copy_n(in, count, out);
      } else {
        for (int i = 0; i < count; ++i, in += stride) out[i] = *in;
      }
      return;
    }
    case CV_8UC3: {
      const std::uint8_t* in = image.ptr<std::uint8_t>(y) + 3 * x;
      if (stride == 1) {
        grey_of_bgr(in, count, out);
      } else {
        for (int i = 0; i < count; ++i, in += 3 * stride) grey_of_bgr(in, 1, out + i);
      }
      return;
    }
    case CV_16UC1: {
      const std::uint16_t* in = image.ptr<std::uint16_t>(y) + x;
      for (int i = 0; i < count; ++i, in += stride) out[i] = to_level(factor_ * *in);
      return;
    }
    case CV_16UC3: {
      const std::uint16_t* in = image.ptr<std::uint16_t>(y) + 3 * x;
      for (int i = 0; i < count; ++i, in += 3 * stride) out[i] = to_level(factor_ * grey_of_bgr(in));
      return;
    }
    default:
      TS_ASSERT(false && "image types are checked before");
  }
}

const LevelTable& BrightnessScale::levels_of(const cv::Mat& image) const {
  return image.depth() == CV_8U ? table_ : kSameLevels;
}

bool read_window(const cv::Mat& image, const BrightnessScale& scale, const Eigen::Vector2d& centre, int side,
                 int stride, GreyWindow& window) {
  const int left = static_cast<int>(std::lround(centre.x() - 0.5 * side));
  const int top = static_cast<int>(std::lround(centre.y() - 0.5 * side));
  const int right = std::min(left + side, image.cols);
  const int bottom = std::min(top + side, image.rows);
  window.x = std::max(left, 0);
  window.y = std::max(top, 0);
  if (window.x >= right || window.y >= bottom) return false;
  window.stride = stride;
  window.levels = &scale.levels_of(image);
  window.width = (right - window.x + stride - 1) / stride;
  window.height = (bottom - window.y + stride - 1) / stride;
  TS_ASSERT(window.width <= BitWindow::kMaxSide && window.height <= BitWindow::kMaxSide);
  std::uint8_t* out = window.grey.data();
  for (int row = 0; row < window.height; ++row, out += window.width) {
    scale.read(image, window.x, window.y + row * stride, stride, window.width, out);
  }
  return true;
}

std::optional<std::size_t> otsu_threshold(std::span<const ValueCount> histogram) {
  TS_ASSERT(histogram.size() <= kMostValues);
  if (histogram.size() < 2) return std::nullopt;
  // Of the entries up to each one; whole numbers below 2^53, so exact.
  std::array<double, kMostValues> counts, sums, between;
  int count = 0, sum = 0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    counts[i] = count += histogram[i].count;
    sums[i] = sum += histogram[i].value * histogram[i].count;
  }
  variances_between(counts.data(), sums.data(), static_cast<int>(histogram.size()), between.data());
  double best = 0.0;
  std::optional<std::size_t> threshold;
  for (std::size_t i = 0; i + 1 < histogram.size(); ++i) {
    if (between[i] > best) {
      best = between[i];
      threshold = i;
    }
  }
  return threshold;
}

namespace {

/// The areas that a region may have, px.
struct AreaRange {
  double least, most;
};

/// Steps iv to vii at the threshold that Otsu's method finds among contrasts of at least `first`, which it moves on.
class ThresholdRound {
 public:
  ThresholdRound(const GreyWindow& window, const BeadSearch& search)
      : window_(window),
        search_(search),
        settings_(search.settings),
        contrasts_(contrasts_of(window, settings_.appearance.polarity, settings_.contrast)) {}

  /// False if there's no further threshold, or one that doesn't part two clearly different classes.
  bool next_threshold() {
    const std::optional<std::size_t> threshold = otsu_threshold(contrasts_.from(first_));
    if (!threshold) return false;
    last_low_ = first_ + *threshold;
    difference_ = class_difference(contrasts_, first_, last_low_);
    first_ = last_low_ + 1;
    return difference_ >= settings_.appearance.min_difference;
  }

  /// Moves the threshold to where about so many of the window's pixels are above it. @pre two contrasts occur
  void highlight(double pixels) {
    last_low_ = contrasts_.size - 2;
    int above = contrasts_.histogram[contrasts_.size - 1].count;
    while (last_low_ > 0 && above + contrasts_.histogram[last_low_].count <= pixels) {
      above += contrasts_.histogram[last_low_].count;
      --last_low_;
    }
    difference_ = class_difference(contrasts_, 0, last_low_);
  }

  /// The region at this threshold that looks like a bead and is nearest to the expected place (or the largest).
  std::optional<BeadMeasurement> find(const AreaRange& areas, double max_elongation) {
    BitWindow bits;
    binarise(window_, contrasts_, last_low_, settings_.appearance.polarity, bits);
    const int radius = window_.stride == 1 ? settings_.morphology_px / 2 : 0;
    if (radius > 0) {
      open_regions(bits, radius);
      close_regions(bits, radius);
    }
    const double pixel_area = static_cast<double>(window_.stride) * window_.stride;
    std::optional<BeadMeasurement> best;
    double best_rank = 0.0;
    BitWindow region, best_region;
    while (take_region(bits, region)) {
      const RegionMoments moments = moments_of(region);
      const double area = moments.area * pixel_area;
      if (area < areas.least || area > areas.most || moments.elongation > max_elongation) continue;
      const Eigen::Vector2d half(0.5, 0.5);
      const Eigen::Vector2d centroid =
          Eigen::Vector2d(window_.x, window_.y) + window_.stride * (moments.centroid - half) + half;
      const double rank = search_.take_largest ? -area : (centroid - search_.near).squaredNorm();
      if (best && rank >= best_rank) continue;
      best_rank = rank;
      best = BeadMeasurement{centroid, area, difference_, touches_border(region), false, moments.elongation};
      best_region = region;
    }
    if (best && settings_.centroid == CentroidKind::kWeighted && window_.stride == 1) {
      const Eigen::Vector2d origin(window_.x, window_.y);
      best->centroid = origin + weighted_centroid(window_, contrasts_, best_region, last_low_, best->centroid - origin);
    }
    return best;
  }

 private:
  const GreyWindow& window_;
  const BeadSearch& search_;
  const BeadTrackerSettings& settings_;
  Contrasts contrasts_;
  std::size_t first_ = 0;     ///< entry of the contrasts that next_threshold parts
  std::size_t last_low_ = 0;  ///< the last entry below the threshold
  double difference_ = 0.0;
};

}  // namespace

std::optional<BeadMeasurement> measure_bead(const GreyWindow& window, const BeadSearch& search) {
  const BeadTrackerSettings& settings = search.settings;
  const BeadAppearance& appearance = settings.appearance;
  AreaRange whole{appearance.min_area_px, appearance.max_area_fraction * settings.roi_b_px * settings.roi_b_px};
  AreaRange core = whole;
  if (search.expected_area_px > 0.0) {
    whole.least = std::max(whole.least, search.expected_area_px / appearance.max_area_change);
    whole.most = std::min(whole.most, search.expected_area_px * appearance.max_area_change);
    core.least = std::max(core.least, search.expected_area_px * appearance.least_core);
    core.most = std::min(core.most, search.expected_area_px);
  }
  ThresholdRound round(window, search);
  if (!round.next_threshold()) return std::nullopt;
  const std::optional<BeadMeasurement> bead = round.find(whole, appearance.max_elongation);
  // A region of more than the bead's area, and not its shape: the bead and something that touches it.
  bool joined = search.expected_area_px > 0.0 && appearance.least_core < 1.0 &&
                (!bead || bead->cut || bead->elongation > appearance.core_elongation);
  if (joined) {
    const AreaRange larger{search.expected_area_px, std::numeric_limits<double>::infinity()};
    joined = round.find(larger, std::numeric_limits<double>::infinity()).has_value();
  }

  // The core: what stands out of the highlighted pixels themselves. Of a bead alone it is the bead's own middle; where
  // something half as dark touches the bead, only the core shows where the bead is.
  constexpr int kCoreRounds = 2;
  for (int i = 0; i < kCoreRounds && round.next_threshold(); ++i) {
    std::optional<BeadMeasurement> middle = round.find(core, appearance.core_elongation);
    if (!middle || middle->cut) continue;
    if (bead && !bead->cut && (middle->centroid - bead->centroid).norm() <= appearance.core_shift_px) return bead;
    middle->is_core = true;
    return middle;
  }
  // What touches the bead is nearly as dark: only the bead's darkest pixels are its own.
  if (joined) {
    round.highlight(appearance.least_core * search.expected_area_px);
    const AreaRange darkest{std::max(appearance.min_area_px, 0.5 * appearance.least_core * search.expected_area_px),
                            appearance.least_core * search.expected_area_px};
    // So few pixels are often in a row; a line alone is longer still.
    std::optional<BeadMeasurement> middle = round.find(darkest, 2.0 * appearance.max_elongation);
    if (middle && !middle->cut && middle->difference >= appearance.min_difference) {
      middle->is_core = true;
      return middle;
    }
  }
  return bead;
}

}  // namespace touchstone::sensors
