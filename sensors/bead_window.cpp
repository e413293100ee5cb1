#include "sensors/bead_window.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

// OpenCV's weights of blue, green and red, in 1/2^15.
constexpr int kBlue = 3735;
constexpr int kGreen = 19235;
constexpr int kRed = 9798;
constexpr int kWeightBits = 15;

template <typename T>
int grey_of_bgr(const T* pixel) {
  // 16-bit values times 15-bit weights need 31 bits and their sum exactly 32 at most: unsigned holds it.
  const auto sum = static_cast<unsigned>(kBlue) * pixel[0] + static_cast<unsigned>(kGreen) * pixel[1] +
                   static_cast<unsigned>(kRed) * pixel[2];
  return static_cast<int>((sum + (1u << (kWeightBits - 1))) >> kWeightBits);
}

std::uint8_t to_level(double value) {
  return static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
}

/// How often each grey value occurs in a window; only values from `lowest` to `highest` do.
struct GreyHistogram {
  std::array<int, 256> count;
  int lowest;
  int highest;
};

GreyHistogram grey_histogram(const GreyWindow& window) {
  // Four histograms in turn, so that equal neighbours don't wait for each other's increment.
  std::array<std::array<std::uint16_t, 256>, 4> part{};
  const std::size_t pixels = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  std::size_t i = 0;
  for (; i + 4 <= pixels; i += 4) {
    ++part[0][window.grey[i]];
    ++part[1][window.grey[i + 1]];
    ++part[2][window.grey[i + 2]];
    ++part[3][window.grey[i + 3]];
  }
  for (; i < pixels; ++i) ++part[0][window.grey[i]];
  GreyHistogram histogram;
  for (std::size_t v = 0; v < 256; ++v) {
    histogram.count[v] = part[0][v] + part[1][v] + part[2][v] + part[3][v];
  }
  histogram.lowest = 0;
  histogram.highest = 255;
  while (histogram.count[static_cast<std::size_t>(histogram.lowest)] == 0) ++histogram.lowest;
  while (histogram.count[static_cast<std::size_t>(histogram.highest)] == 0) --histogram.highest;
  return histogram;
}

/// What a window's grey values become in step iv, and how they're spread. It rises with the grey value, or falls where
/// beads are dark; only grey values that occur have an entry.
struct Contrast {
  std::array<std::uint8_t, 256> of_grey;
  std::array<int, 256> histogram;  ///< of the contrast values
};

Contrast contrast_of(const GreyHistogram& grey, int pixels, BeadPolarity polarity, double factor) {
  std::int64_t sum = 0;
  for (int v = grey.lowest; v <= grey.highest; ++v) {
    sum += static_cast<std::int64_t>(v) * grey.count[static_cast<std::size_t>(v)];
  }
  const double mean = static_cast<double>(sum) / pixels;
  const double sign = polarity == BeadPolarity::kDark ? -factor : factor;
  Contrast contrast;
  contrast.histogram.fill(0);
  for (int v = grey.lowest; v <= grey.highest; ++v) {
    const std::uint8_t value = to_level(sign * (v - mean));
    contrast.of_grey[static_cast<std::size_t>(v)] = value;
    contrast.histogram[value] += grey.count[static_cast<std::size_t>(v)];
  }
  return contrast;
}

/// Difference of the mean grey values on both sides of a contrast threshold, among contrasts of at least `first`.
double class_difference(const GreyHistogram& grey, const Contrast& contrast, int first, int threshold) {
  std::int64_t sum[2] = {0, 0};
  std::int64_t pixels[2] = {0, 0};
  for (int v = grey.lowest; v <= grey.highest; ++v) {
    const auto i = static_cast<std::size_t>(v);
    if (contrast.of_grey[i] < first) continue;
    const int side = contrast.of_grey[i] > threshold ? 1 : 0;
    sum[side] += static_cast<std::int64_t>(v) * grey.count[i];
    pixels[side] += grey.count[i];
  }
  if (pixels[0] == 0 || pixels[1] == 0) return 0.0;
  return std::abs(static_cast<double>(sum[1]) / static_cast<double>(pixels[1]) -
                  static_cast<double>(sum[0]) / static_cast<double>(pixels[0]));
}

/// One bit a pixel: set where the contrast is above the threshold.
void binarise(const GreyWindow& window, const GreyHistogram& grey, const Contrast& contrast, int threshold,
              BeadPolarity polarity, BitWindow& bits) {
  // Contrast is monotonic in the grey value, so the bead's values are one range of them.
  int low = grey.lowest;
  int high = grey.highest;
  if (polarity == BeadPolarity::kDark) {
    while (high >= low && contrast.of_grey[static_cast<std::size_t>(high)] <= threshold) --high;
  } else {
    while (low <= high && contrast.of_grey[static_cast<std::size_t>(low)] <= threshold) ++low;
  }
  bits.width = window.width;
  bits.height = window.height;
  const auto width = static_cast<std::size_t>(window.width);
  const std::uint8_t* in = window.grey.data();
  std::array<std::uint8_t, BitWindow::kMaxSide> is_bead{};
  for (int y = 0; y < window.height; ++y, in += width) {
    for (std::size_t x = 0; x < width; ++x) is_bead[x] = in[x] >= low && in[x] <= high ? 1 : 0;
    std::uint64_t row = 0;
    for (std::size_t x = 0; x < width; x += 8) {
      // The product brings byte i's lowest bit to bit 56 + i.
      std::uint64_t eight = 0;
      for (std::size_t i = 0; i < 8; ++i) eight |= static_cast<std::uint64_t>(is_bead[x + i]) << (8 * i);
      row |= ((eight * 0x0102040810204080u) >> 56) << x;
    }
    bits.rows[static_cast<std::size_t>(y)] = row;
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
Eigen::Vector2d weighted_centroid(const GreyWindow& window, const Contrast& contrast, const BitWindow& region,
                                  int threshold, const Eigen::Vector2d& fallback) {
  double bead_sum = 0.0, bead_count = 0.0, back_sum = 0.0, back_count = 0.0;
  for (int v = 0; v < 256; ++v) {
    const double count = contrast.histogram[static_cast<std::size_t>(v)];
    (v > threshold ? bead_sum : back_sum) += count * v;
    (v > threshold ? bead_count : back_count) += count;
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
      const double weight = std::clamp((contrast.of_grey[grey] - back) / (bead - back), 0.0, 1.0);
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
      for (int i = 0; i < count; ++i, in += stride) out[i] = table_[*in];
      return;
    }
    case CV_8UC3: {
      const std::uint8_t* in = image.ptr<std::uint8_t>(y) + 3 * x;
      for (int i = 0; i < count; ++i, in += 3 * stride) out[i] = table_[static_cast<std::size_t>(grey_of_bgr(in))];
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

double mean_grey(const cv::Mat& image, const cv::Rect& part) {
  const cv::Scalar mean = cv::mean(image(part));
  if (image.channels() == 1) return mean[0];
  return (kBlue * mean[0] + kGreen * mean[1] + kRed * mean[2]) / (1 << kWeightBits);
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
  window.width = (right - window.x + stride - 1) / stride;
  window.height = (bottom - window.y + stride - 1) / stride;
  TS_ASSERT(window.width <= BitWindow::kMaxSide && window.height <= BitWindow::kMaxSide);
  std::uint8_t* out = window.grey.data();
  for (int row = 0; row < window.height; ++row, out += window.width) {
    scale.read(image, window.x, window.y + row * stride, stride, window.width, out);
  }
  return true;
}

std::optional<int> otsu_threshold(const std::array<int, 256>& histogram, int first) {
  std::int64_t count = 0, sum = 0;
  for (int v = first; v < 256; ++v) {
    count += histogram[static_cast<std::size_t>(v)];
    sum += static_cast<std::int64_t>(v) * histogram[static_cast<std::size_t>(v)];
  }
  std::int64_t low_count = 0, low_sum = 0;
  double best = 0.0;
  std::optional<int> threshold;
  for (int v = first; v < 256; ++v) {
    const int here = histogram[static_cast<std::size_t>(v)];
    if (here == 0) continue;  // the classes are as for the value before
    low_count += here;
    low_sum += static_cast<std::int64_t>(v) * here;
    if (low_count == count) break;
    // Variance between the classes times the squared count: n1 n2 (m1 - m2)^2 with one division.
    const auto difference = static_cast<double>(low_sum * count - sum * low_count);
    const double between =
        difference * difference / (static_cast<double>(low_count) * static_cast<double>(count - low_count));
    if (between > best) {
      best = between;
      threshold = v;
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
        grey_(grey_histogram(window)),
        contrast_(contrast_of(grey_, window.width * window.height, settings_.look.polarity, settings_.contrast)) {}

  /// False if there's no further threshold, or one that doesn't part two clearly different classes.
  bool next_threshold() {
    const std::optional<int> threshold = otsu_threshold(contrast_.histogram, first_);
    if (!threshold) return false;
    threshold_ = *threshold;
    difference_ = class_difference(grey_, contrast_, first_, threshold_);
    first_ = threshold_ + 1;
    return difference_ >= settings_.look.min_difference;
  }

  /// Moves the threshold to where about so many of the window's pixels are above it.
  void highlight(double pixels) {
    int above = 0;
    threshold_ = 255;
    while (threshold_ > 0) {
      const int more = contrast_.histogram[static_cast<std::size_t>(threshold_)];
      if (above > 0 && above + more > pixels) break;
      above += more;
      --threshold_;
    }
    difference_ = class_difference(grey_, contrast_, 0, threshold_);
  }

  /// The region at this threshold that looks like a bead and is nearest to the expected place (or the largest).
  std::optional<BeadMeasurement> find(const AreaRange& areas, double max_elongation) {
    BitWindow bits;
    binarise(window_, grey_, contrast_, threshold_, settings_.look.polarity, bits);
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
      best->centroid = origin + weighted_centroid(window_, contrast_, best_region, threshold_, best->centroid - origin);
    }
    return best;
  }

 private:
  const GreyWindow& window_;
  const BeadSearch& search_;
  const BeadTrackerSettings& settings_;
  GreyHistogram grey_;
  Contrast contrast_;
  int first_ = 0;
  int threshold_ = 0;
  double difference_ = 0.0;
};

}  // namespace

std::optional<BeadMeasurement> measure_bead(const GreyWindow& window, const BeadSearch& search) {
  const BeadTrackerSettings& settings = search.settings;
  const BeadLook& look = settings.look;
  AreaRange whole{look.min_area_px, look.max_area_fraction * settings.roi_b_px * settings.roi_b_px};
  AreaRange core = whole;
  if (search.expected_area_px > 0.0) {
    whole.least = std::max(whole.least, search.expected_area_px / look.max_area_change);
    whole.most = std::min(whole.most, search.expected_area_px * look.max_area_change);
    core.least = std::max(core.least, search.expected_area_px * look.least_core);
    core.most = std::min(core.most, search.expected_area_px);
  }
  ThresholdRound round(window, search);
  if (!round.next_threshold()) return std::nullopt;
  const std::optional<BeadMeasurement> bead = round.find(whole, look.max_elongation);
  // A region of more than the bead's area, and not its shape: the bead and something that touches it.
  bool joined = search.expected_area_px > 0.0 && look.least_core < 1.0 &&
                (!bead || bead->cut || bead->elongation > look.core_elongation);
  if (joined) {
    const AreaRange larger{search.expected_area_px, std::numeric_limits<double>::infinity()};
    joined = round.find(larger, std::numeric_limits<double>::infinity()).has_value();
  }

  // The core: what stands out of the highlighted pixels themselves. Of a bead alone it is the bead's own middle; where
  // something half as dark touches the bead, only the core tells where the bead is.
  constexpr int kCoreRounds = 2;
  for (int i = 0; i < kCoreRounds && round.next_threshold(); ++i) {
    std::optional<BeadMeasurement> middle = round.find(core, look.core_elongation);
    if (!middle || middle->cut) continue;
    if (bead && !bead->cut && (middle->centroid - bead->centroid).norm() <= look.core_shift_px) return bead;
    middle->is_core = true;
    return middle;
  }
  // What touches the bead is nearly as dark: only the bead's darkest pixels are its own.
  if (joined) {
    round.highlight(look.least_core * search.expected_area_px);
    const AreaRange darkest{std::max(look.min_area_px, 0.5 * look.least_core * search.expected_area_px),
                            look.least_core * search.expected_area_px};
    // So few pixels are often in a row; a line alone is longer still.
    std::optional<BeadMeasurement> middle = round.find(darkest, 2.0 * look.max_elongation);
    if (middle && !middle->cut && middle->difference >= look.min_difference) {
      middle->is_core = true;
      return middle;
    }
  }
  return bead;
}

}  // namespace touchstone::sensors
