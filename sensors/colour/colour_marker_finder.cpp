#include "sensors/colour/colour_marker_finder.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"
#include "sensors/colour/colour_coverage.h"
#include "sensors/colour/colour_lattice.h"

namespace touchstone::sensors {

namespace {

constexpr double kMargin = 1.25;  ///< spacings round the grid that are looked at
constexpr double kReducedSpacing_px = 48.0;
constexpr double kLatticePixels = 6e6;     ///< the grid is sought in no larger picture
constexpr int kDarkest = 24;               ///< of kWhite: darker pixels have no colour
constexpr double kColouredRatio = 0.6;     ///< a channel below this part of the largest is taken out by ink or filter
constexpr double kLeastColourShare = 0.1;  ///< of the coloured pixels, that each of ink and filter must have at rest
constexpr int kWhollyCovered = 230;        ///< of 255
constexpr int kMostInkOfFilter = 77;       ///< of 255, that a filter alone looks like
constexpr int kLeastBareFilter_px = 16;
constexpr double kBareFilter = 0.25;  ///< so many filter pixels have no ink at all, if filter shows beside it

void check_range(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    fail("coloured marker {} is {}, it must be from {} to {}", name, value, low, high);
  }
}

/// The bin below which a part of all that were counted are.
int level_of(const std::array<int, 256>& counts, double part) {
  const double enough = part * std::accumulate(counts.begin(), counts.end(), 0);
  int sum = 0, level = 0;
  while (level < 255 && (sum += counts[static_cast<std::size_t>(level)]) <= enough) ++level;
  return level;
}

/// The pixels of a picture from which one channel is taken out.
struct ColourCounts {
  const char* what;
  int channel;
  int count = 0;
  std::array<int, 256> ratios{};     ///< channel / largest channel, of 255
  std::array<int, 256> brightest{};  ///< largest channel

  void add(const std::uint8_t* bgr, int highest) {
    if (bgr[channel] >= kColouredRatio * highest) return;
    ++count;
    ++ratios[static_cast<std::size_t>(255 * bgr[channel] / highest)];
    ++brightest[static_cast<std::size_t>(highest)];
  }

  /// A pixel of coverage a has a mix of light, channel 1 - a + a g and largest channel 1 - a + a m of white's; the
  /// ratio q of the two is solved for a.
  std::array<std::uint8_t, 256> coverage_of_ratio(int coloured) const {
    if (count < kLeastColourShare * coloured || count == 0) {
      fail("coloured markers: the picture at rest shows {} in {} of {} coloured pixels, at least {:.0f} % are needed",
           what, count, coloured, 100.0 * kLeastColourShare);
    }
    const double m = std::min(1.0, static_cast<double>(level_of(brightest, 0.5)) / ColourLevelling::kWhite);
    const double g = m * level_of(ratios, 0.5) / 255.0;
    std::array<std::uint8_t, 256> table{};
    for (int ratio = 0; ratio < 256; ++ratio) {
      const double q = ratio / 255.0;
      const double coverage = (1.0 - q) / std::max(1.0 - g - q * (1.0 - m), 1e-3);
      table[static_cast<std::size_t>(ratio)] =
          static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(coverage, 0.0, 1.0)));
    }
    return table;
  }
};

}  // namespace

ColourMarkerFinder::ColourMarkerFinder(const ColourMarkerAppearance& appearance) : appearance_(appearance) {
  check_range("columns", appearance.grid.x(), 2, 64);
  check_range("rows", appearance.grid.y(), 2, 64);
  if (appearance.spacing_px != 0.0) check_range("spacing_px", appearance.spacing_px, 4.0, 4096.0);
  check_range("least_saturation", appearance.least_saturation, 0.2, 0.8);
  check_range("most_under_neighbour", appearance.most_under_neighbour, 0.0, 0.2);
  check_range("least_white", appearance.least_white, 4.0, 128.0);
}

const ColourMarkerReading& ColourMarkerFinder::find_rest(const cv::Mat& image) {
  ColourMarkerFinder next(appearance_);
  next.take_rest(image);
  *this = std::move(next);
  return rest_;
}

void ColourMarkerFinder::take_rest(const cv::Mat& image) {
  if (image.empty() || image.type() != CV_8UC3) {
    fail("coloured markers: the picture has {} channels of depth {}, 8 bit BGR is needed", image.channels(),
         image.depth());
  }
  const int shrink =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(image.total()) / kLatticePixels))));
  cv::Mat smaller = image;
  if (shrink > 1) cv::resize(image, smaller, {image.cols / shrink, image.rows / shrink}, 0, 0, cv::INTER_AREA);
  const double scale = static_cast<double>(image.cols) / smaller.cols;
  ColourLattice lattice = find_colour_lattice(smaller, appearance_.grid, appearance_.spacing_px / scale);
  for (Eigen::Vector2d& place : lattice.places) place *= scale;
  const double spacing = lattice.spacing_px * scale;

  reduction_ = std::max(1, static_cast<int>(spacing / kReducedSpacing_px));
  spacing_px_ = spacing / reduction_;
  size_ = image.size();
  Eigen::Array2d low = lattice.places[0], high = lattice.places[0];
  for (const Eigen::Vector2d& place : lattice.places) {
    low = low.min(place.array());
    high = high.max(place.array());
  }
  low = (low - kMargin * spacing).max(0.0).floor();
  high = (high + kMargin * spacing).ceil().min(Eigen::Array2d(size_.width, size_.height));
  const Eigen::Array2i wide = ((high - low) / reduction_).floor().cast<int>() * reduction_;
  region_ = {static_cast<int>(low.x()), static_cast<int>(low.y()), wide.x(), wide.y()};
  for (Eigen::Vector2d& place : lattice.places) place = (place.array() - low) / reduction_;

  levelling_.emplace_back(spacing_px_);
  take_picture(image);
  learn_colours();
  classify();
  place_filters(lattice.places);
  find_ink();
  stray_at_rest_ = owners_.stray;
  add_up();
  read(nullptr, rest_);
  for (const Sums& sums : sums_) filter_at_rest_.push_back(sums.filter);
}

const ColourMarkerReading& ColourMarkerFinder::find(const cv::Mat& image) {
  if (levelling_.empty()) fail("coloured markers: find_rest must come before find");
  if (image.type() != CV_8UC3) {
    fail("coloured markers: the picture has {} channels of depth {}, 8 bit BGR is needed", image.channels(),
         image.depth());
  }
  if (image.size() != size_) {
    fail("coloured markers: the picture is {} x {} px, the one at rest was {} x {}", image.cols, image.rows,
         size_.width, size_.height);
  }
  take_picture(image);
  classify();
  find_ink();
  add_up();
  read(&rest_, reading_);
  return reading_;
}

void ColourMarkerFinder::take_picture(const cv::Mat& image) {
  const cv::Mat region = image(region_);
  if (reduction_ > 1) {
    cv::resize(region, part_, {region_.width / reduction_, region_.height / reduction_}, 0, 0, cv::INTER_AREA);
  } else {
    part_ = region;
  }
  levelled_ = levelling_.front().level(part_);
}

void ColourMarkerFinder::learn_colours() {
  ColourCounts ink{"magenta ink (little green)", 1}, filter{"yellow filter (little blue)", 0};
  int coloured = 0;
  for (int y = 0; y < levelled_.rows; ++y) {
    const std::uint8_t* bgr = levelled_.ptr<std::uint8_t>(y);
    for (int x = 0; x < levelled_.cols; ++x, bgr += 3) {
      const int highest = std::max({bgr[0], bgr[1], bgr[2]});
      const int lowest = std::min({bgr[0], bgr[1], bgr[2]});
      if (highest < kDarkest || lowest >= kColouredRatio * highest) continue;
      ++coloured;
      ink.add(bgr, highest);
      filter.add(bgr, highest);
    }
  }
  ink_of_ratio_ = ink.coverage_of_ratio(coloured);
  filter_of_ratio_ = filter.coverage_of_ratio(coloured);
}

void ColourMarkerFinder::classify() {
  static const std::array<int, 256> kReciprocal = [] {
    std::array<int, 256> reciprocal{};
    for (int value = 1; value < 256; ++value) reciprocal[static_cast<std::size_t>(value)] = (255 << 16) / value + 1;
    return reciprocal;
  }();
  ink_.create(levelled_.size(), CV_8U);
  filter_.create(levelled_.size(), CV_8U);
  core_.create(levelled_.size(), CV_8U);
  for (int y = 0; y < levelled_.rows; ++y) {
    const std::uint8_t* bgr = levelled_.ptr<std::uint8_t>(y);
    std::uint8_t* ink = ink_.ptr<std::uint8_t>(y);
    std::uint8_t* filter = filter_.ptr<std::uint8_t>(y);
    for (int x = 0; x < levelled_.cols; ++x, bgr += 3) {
      const int highest = std::max({bgr[0], bgr[1], bgr[2]});
      const int per = highest < kDarkest ? 0 : kReciprocal[static_cast<std::size_t>(highest)];
      const bool has_colour = per != 0;
      ink[x] = has_colour ? ink_of_ratio_[static_cast<std::size_t>((bgr[1] * per) >> 16)] : std::uint8_t{0};
      filter[x] = has_colour ? filter_of_ratio_[static_cast<std::size_t>((bgr[0] * per) >> 16)] : std::uint8_t{0};
    }
  }
  take_filter_from_ink();
  for (int y = 0; y < levelled_.rows; ++y) {
    const std::uint8_t* ink = ink_.ptr<std::uint8_t>(y);
    std::uint8_t* core = core_.ptr<std::uint8_t>(y);
    for (int x = 0; x < levelled_.cols; ++x) core[x] = ink[x] >= kInkCore;
  }
}

void ColourMarkerFinder::take_filter_from_ink() {
  std::array<int, 256> counts{};
  for (int y = 0; y < levelled_.rows; ++y) {
    const std::uint8_t* ink = ink_.ptr<std::uint8_t>(y);
    const std::uint8_t* filter = filter_.ptr<std::uint8_t>(y);
    for (int x = 0; x < levelled_.cols; ++x) {
      if (filter[x] >= kWhollyCovered && ink[x] < kMostInkOfFilter) ++counts[ink[x]];
    }
  }
  // Where hardly any filter is without ink, none of its rims matters.
  if (std::accumulate(counts.begin(), counts.end(), 0) < kLeastBareFilter_px) return;
  const double of_filter = level_of(counts, kBareFilter) / 255.0;
  // What is left of each coverage under each: a table is made faster than as many pixels are worked out.
  ink_under_filter_.resize(256 * 256);
  for (int f = 0; f < 256; ++f) {
    const auto share = static_cast<float>(of_filter * f);
    const float rest = 1.0F / (1.0F - share / 255.0F);
    std::uint8_t* row = ink_under_filter_.data() + 256 * f;
    for (int i = 0; i < 256; ++i) {
      row[i] = static_cast<std::uint8_t>(std::max((static_cast<float>(i) - share) * rest, 0.0F) + 0.5F);
    }
  }
  for (int y = 0; y < levelled_.rows; ++y) {
    std::uint8_t* ink = ink_.ptr<std::uint8_t>(y);
    const std::uint8_t* filter = filter_.ptr<std::uint8_t>(y);
    for (int x = 0; x < levelled_.cols; ++x) ink[x] = ink_under_filter_[256U * filter[x] + ink[x]];
  }
}

void ColourMarkerFinder::place_filters(const std::vector<Eigen::Vector2d>& places) {
  // First the regions' cells, then those of the filters that are in them: a corner's filter may be off its marker.
  filter_place_ = places;
  filter_area_.assign(places.size(), 0.0);
  for (int round = 0; round < 2; ++round) {
    cell_.create(levelled_.size(), CV_16S);
    cell_.setTo(-1);
    cv::Mat distance(levelled_.size(), CV_32F, cv::Scalar(1e30));
    std::vector<Eigen::Vector3d> moments(places.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector2d middle = filter_place_[i];
      const double reach = 0.7 * spacing_px_;
      for (int y = std::max(0, static_cast<int>(middle.y() - reach));
           y < std::min<double>(levelled_.rows, middle.y() + reach); ++y) {
        for (int x = std::max(0, static_cast<int>(middle.x() - reach));
             x < std::min<double>(levelled_.cols, middle.x() + reach); ++x) {
          const auto here = static_cast<float>((Eigen::Vector2d(x + 0.5, y + 0.5) - middle).squaredNorm());
          if (here >= distance.at<float>(y, x)) continue;
          distance.at<float>(y, x) = here;
          cell_.at<std::int16_t>(y, x) = static_cast<std::int16_t>(i);
        }
      }
    }
    for (int y = 0; y < cell_.rows; ++y) {
      for (int x = 0; x < cell_.cols; ++x) {
        const std::int16_t i = cell_.at<std::int16_t>(y, x);
        const double weight = weight_of(filter_.at<std::uint8_t>(y, x));
        if (i >= 0 && weight > 0.0)
          moments[static_cast<std::size_t>(i)] += weight * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
      }
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      filter_area_[i] = moments[i].z();
      if (moments[i].z() > 0.0) filter_place_[i] = moments[i].head<2>() / moments[i].z();
    }
    std::vector<double> areas = filter_area_;
    std::nth_element(areas.begin(), areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2), areas.end());
    usual_area_ = areas[areas.size() / 2];
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (filter_area_[i] < kLeastFilter * usual_area_) filter_place_[i] = places[i];
    }
  }
  cut_off_.assign(places.size(), 0);
  filter_at_.create(levelled_.size(), CV_16S);
  for (int y = 0; y < cell_.rows; ++y) {
    for (int x = 0; x < cell_.cols; ++x) {
      const bool has_filter = filter_.at<std::uint8_t>(y, x) >= kHalfCovered;
      const std::int16_t i = has_filter ? cell_.at<std::int16_t>(y, x) : std::int16_t{-1};
      filter_at_.at<std::int16_t>(y, x) = i;
      const bool at_border = x == 0 || y == 0 || x == cell_.cols - 1 || y == cell_.rows - 1;
      if (at_border && i >= 0) cut_off_[static_cast<std::size_t>(i)] = 1;
    }
  }
}

}  // namespace touchstone::sensors
