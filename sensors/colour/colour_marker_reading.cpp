// The part of ColourMarkerFinder that makes a reading of a classified picture.

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sensors/colour/colour_coverage.h"
#include "sensors/colour/colour_marker_finder.h"
#include "sensors/colour/hue.h"
#include "sensors/colour/marker_surroundings.h"

namespace touchstone::sensors {

namespace {

constexpr double kLeastPatch = 0.1;        ///< of the usual area: smaller patches of ink are noise
constexpr double kLeastInk = 0.4;          ///< of the usual area: at rest, a marker
constexpr double kLeastSaturated = 0.25;   ///< of the usual area: pixels with a hue
constexpr double kLeastFilterSeen = 0.75;  ///< of its coverage at rest, over its place at rest
constexpr int kFullScale = 254;
constexpr double kMostClipped = 0.05;  ///< of a marker's pixels
constexpr double kBrightestWhite = 252.0;
constexpr double kNotWhite = 0.85;  ///< of white: where a filter should be and isn't, something grey is
constexpr int kRim_px = 2;          ///< a rim pixel is no farther from its patch

}  // namespace

void ColourMarkerFinder::find_ink() {
  const std::size_t markers = filter_place_.size();
  const int labels = cv::connectedComponentsWithStats(core_, labels_, stats_, centroids_, 4, CV_32S);
  patch_of_label_.assign(static_cast<std::size_t>(labels), -1);
  std::size_t count = 0;
  for (int label = 1; label < labels; ++label) {
    const int area = stats_.at<int>(label, cv::CC_STAT_AREA);
    if (area < kLeastPatch * usual_area_) continue;
    patch_of_label_[static_cast<std::size_t>(label)] = static_cast<int>(count);
    if (count == patches_.size()) patches_.emplace_back();
    InkPatch& patch = patches_[count++];
    patch.area_px = area;
    const int left = stats_.at<int>(label, cv::CC_STAT_LEFT), top = stats_.at<int>(label, cv::CC_STAT_TOP);
    patch.at_border = left == 0 || top == 0 || left + stats_.at<int>(label, cv::CC_STAT_WIDTH) == labels_.cols ||
                      top + stats_.at<int>(label, cv::CC_STAT_HEIGHT) == labels_.rows;
    patch.under.assign(markers, 0);
  }
  patches_.resize(count);
  for (int y = 0; y < labels_.rows; ++y) {
    const int* label = labels_.ptr<int>(y);
    const std::int16_t* filter = filter_at_.ptr<std::int16_t>(y);
    for (int x = 0; x < labels_.cols; ++x) {
      if (label[x] == 0 || filter[x] < 0) continue;
      const int patch = patch_of_label_[static_cast<std::size_t>(label[x])];
      if (patch >= 0) ++patches_[static_cast<std::size_t>(patch)].under[static_cast<std::size_t>(filter[x])];
    }
  }
  owners_ = own_ink(patches_, markers, {usual_area_, appearance_.most_under_neighbour});
}

int ColourMarkerFinder::patch_near(int x, int y) const {
  int found = -1, least = 2 * kRim_px * kRim_px + 1;
  for (int v = std::max(y - kRim_px, 0); v <= std::min(y + kRim_px, labels_.rows - 1); ++v) {
    const int* label = labels_.ptr<int>(v);
    for (int u = std::max(x - kRim_px, 0); u <= std::min(x + kRim_px, labels_.cols - 1); ++u) {
      const int far = (u - x) * (u - x) + (v - y) * (v - y);
      if (label[u] == 0 || far >= least) continue;
      const int patch = patch_of_label_[static_cast<std::size_t>(label[u])];
      if (patch < 0) continue;
      found = patch;
      least = far;
    }
  }
  return found;
}

void ColourMarkerFinder::add_up() {
  static const std::array<double, 256> kWeights = [] {
    std::array<double, 256> weights{};
    for (int i = 0; i < 256; ++i) weights[static_cast<std::size_t>(i)] = weight_of(i);
    return weights;
  }();
  sums_.assign(filter_place_.size(), {});
  const int least_ink = static_cast<int>(std::ceil(255.0 * kLeastCoverage));
  for (int y = 0; y < levelled_.rows; ++y) {
    const std::uint8_t* bgr = levelled_.ptr<std::uint8_t>(y);
    const std::uint8_t* raw = part_.ptr<std::uint8_t>(y);
    const std::uint8_t* ink = ink_.ptr<std::uint8_t>(y);
    const std::uint8_t* filter = filter_.ptr<std::uint8_t>(y);
    const int* label = labels_.ptr<int>(y);
    const std::int16_t* cell = cell_.ptr<std::int16_t>(y);
    const std::int16_t* filter_at = filter_at_.ptr<std::int16_t>(y);
    for (int x = 0; x < levelled_.cols; ++x, bgr += 3, raw += 3) {
      if (filter_at[x] >= 0) {
        Sums& sums = sums_[static_cast<std::size_t>(filter_at[x])];
        sums.filter_value += std::max({bgr[0], bgr[1], bgr[2]});
        ++sums.filter_pixels;
        sums.filter += filter[x];
      }
      const std::uint8_t coverage = std::max(ink[x], filter[x]);
      if (coverage < least_ink) continue;
      int patch = -1;
      if (label[x] != 0) {
        patch = patch_of_label_[static_cast<std::size_t>(label[x])];
      } else if (ink[x] >= least_ink) {
        patch = patch_near(x, y);
      }
      const int ink_owner = patch < 0 ? -1 : owners_.owner[static_cast<std::size_t>(patch)];
      const Eigen::Vector2d place(x + 0.5, y + 0.5);
      if (ink_owner >= 0) {
        Sums& sums = sums_[static_cast<std::size_t>(ink_owner)];
        const double weight = kWeights[ink[x]];
        sums.ink += weight;
        sums.ink_moment += weight * place;
      }
      const bool mostly_ink = patch >= 0 && (label[x] != 0 || ink[x] >= filter[x]);
      const int owner = mostly_ink ? ink_owner : cell[x];
      if (owner < 0) continue;
      Sums& sums = sums_[static_cast<std::size_t>(owner)];
      const double weight = kWeights[coverage];
      sums.coloured += weight;
      sums.coloured_moment += weight * place;
      if (std::max({raw[0], raw[1], raw[2]}) >= kFullScale) ++sums.clipped;
      const int highest = std::max({bgr[0], bgr[1], bgr[2]});
      const int lowest = std::min({bgr[0], bgr[1], bgr[2]});
      if (highest - lowest > appearance_.least_saturation * highest) {
        sums.hue += hue_direction(bgr[0], bgr[1], bgr[2]);
        ++sums.saturated;
      }
    }
  }
}

FrameLight ColourMarkerFinder::light_of_picture() const {
  const cv::Mat& small = levelling_.front().reduced();
  double sum = 0.0;
  float low = 255.0F, high = 0.0F;
  for (int y = 0; y < small.rows; ++y) {
    const auto* row = small.ptr<cv::Vec3f>(y);
    for (int x = 0; x < small.cols; ++x) {
      const auto [lowest, highest] = std::minmax({row[x][0], row[x][1], row[x][2]});
      sum += highest;
      low = std::min(low, lowest);
      high = std::max(high, highest);
    }
  }
  const FrameLight light = light_of_mean(sum / (255.0 * static_cast<double>(small.total())));
  return light == FrameLight::kNormal && !(high - low > 0.5F) ? FrameLight::kFlat : light;
}

MarkerFlaw ColourMarkerFinder::flaw_of(const Sums& sums, std::size_t marker) const {
  const double white = levelling_.front().white_at(filter_place_[marker]).maxCoeff();
  if (white >= kBrightestWhite || sums.clipped > kMostClipped * usual_area_) return MarkerFlaw::kOverexposed;
  if (white < appearance_.least_white) return MarkerFlaw::kUnderexposed;
  if (filter_area_[marker] < kLeastFilter * usual_area_) return MarkerFlaw::kMissing;
  if (cut_off_[marker]) return MarkerFlaw::kCutOff;
  if (owners_.flaws[marker] == MarkerFlaw::kTwoFilters) return MarkerFlaw::kTwoFilters;
  if (sums.saturated < kLeastSaturated * usual_area_) {
    const bool is_white = sums.filter_value > kNotWhite * ColourLevelling::kWhite * sums.filter_pixels;
    return is_white ? MarkerFlaw::kMissing : MarkerFlaw::kColourless;
  }
  // The filter isn't where it was: another picture, or a camera that was knocked.
  if (!filter_at_rest_.empty() && sums.filter < kLeastFilterSeen * filter_at_rest_[marker]) return MarkerFlaw::kMissing;
  if (owners_.flaws[marker] != MarkerFlaw::kNone) return owners_.flaws[marker];
  return sums.ink < kLeastPatch * usual_area_ ? MarkerFlaw::kMissing : MarkerFlaw::kNone;
}

void ColourMarkerFinder::read(const ColourMarkerReading* rest, ColourMarkerReading& reading) {
  const std::size_t count = filter_place_.size();
  reading.light = light_of_picture();
  reading.grid = appearance_.grid;
  reading.markers.assign(count, {});
  const Eigen::Vector2d origin(region_.x, region_.y);
  std::vector<MarkerFlaw> flaws(count);
  std::vector<Eigen::Vector2d> shift(count, Eigen::Vector2d::Zero());
  std::vector<std::uint8_t> missing_at_rest(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const Sums& sums = sums_[i];
    flaws[i] = flaw_of(sums, i);
    if (!rest && flaws[i] == MarkerFlaw::kNone && sums.ink < kLeastInk * usual_area_) flaws[i] = MarkerFlaw::kMissing;
    if (rest && rest->markers[i].flaw != MarkerFlaw::kNone) {
      missing_at_rest[i] = 1;
      flaws[i] = rest->markers[i].flaw;
    }
    if (reading.light == FrameLight::kDark) flaws[i] = MarkerFlaw::kUnderexposed;
    if (reading.light == FrameLight::kSaturated) flaws[i] = MarkerFlaw::kOverexposed;
    if (reading.light == FrameLight::kFlat) flaws[i] = MarkerFlaw::kColourless;
    if (flaws[i] != MarkerFlaw::kNone) continue;
    ColourMarker& marker = reading.markers[i];
    marker.hue = hue_of(sums.hue);
    marker.centroid_px = origin + reduction_ * sums.coloured_moment / sums.coloured;
    marker.ink_centroid_px = origin + reduction_ * sums.ink_moment / sums.ink;
    marker.coloured_area_px = reduction_ * reduction_ * sums.coloured;
    marker.ink_area_px = reduction_ * reduction_ * sums.ink;
    if (rest) shift[i] = (marker.ink_centroid_px - rest->markers[i].ink_centroid_px) / spacing_px();
  }
  if (rest) {
    doubt_enclosed(appearance_.grid, shift, missing_at_rest, flaws);
    // Ink that has left the grid: the others may have moved into its neighbours' places.
    if (owners_.stray > stray_at_rest_) {
      std::replace(flaws.begin(), flaws.end(), MarkerFlaw::kNone, MarkerFlaw::kTwoFilters);
    }
  }
  for (std::size_t i = 0; i < count; ++i) reading.markers[i].flaw = flaws[i];
  find_surroundings(rest ? *rest : reading, reading);
}

}  // namespace touchstone::sensors
