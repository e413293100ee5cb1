#include "sensors/markers/marker_learning.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"
#include "sensors/markers/gel_brightness.h"

namespace touchstone::sensors {

namespace {

constexpr int kMostSide_px = 1000;      ///< a larger picture is halved: markers in it are large, too
constexpr double kLightFloor = 6.0;     ///< grey levels added before the logarithm: below them is noise
constexpr double kFirstSigma_px = 0.9;  ///< of a spot 2.5 px wide
constexpr int kStepsPerOctave = 4;
constexpr int kBlurs = kStepsPerOctave + 3;
constexpr int kLeastSide_px = 24;  ///< of the smallest octave: a spot and what is round it
/// Of a spot some 7 % darker or brighter than the gel. Real frames without markers (a GelSight Mini's, a 9DTact's) stay
/// below 0.035; the faint dots of a calibration board under a 9DTact have 0.06.
constexpr double kLeastResponse = 0.05;
constexpr double kMostElongation = 3.0;  ///< ratio of the curvatures: an edge or a scratch has a larger one
constexpr double kSizeSpread = 1.35;     ///< spots of one kind, up and down
constexpr double kContrastSpread = 0.4;  ///< of a kind's usual response; weaker ones aren't of it
constexpr double kDiameterPerSigma = 2.0 * std::numbers::sqrt2;  ///< of the disc that a sigma answers to most

/// A place where something round stands out.
struct Spot {
  Eigen::Vector2d place_px = Eigen::Vector2d::Zero();
  double diameter_px = 0.0;
  double response = 0.0;  ///< above 0; 0.74 times the disc's contrast in logarithms of light
  MarkerPolarity polarity = MarkerPolarity::kDark;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Whether |value| is larger than that of the 26 neighbours in place and size, with its sign.
bool is_extreme(const std::array<cv::Mat, kBlurs - 1>& responses, int level, int x, int y, float value) {
  const float sign = value > 0.0f ? 1.0f : -1.0f;
  bool before = true;  // of equals the first one is it
  for (int i = level - 1; i <= level + 1; ++i) {
    for (int v = y - 1; v <= y + 1; ++v) {
      const float* row = responses[static_cast<std::size_t>(i)].ptr<float>(v);
      for (int u = x - 1; u <= x + 1; ++u) {
        if (i == level && v == y && u == x) {
          before = false;
        } else if (sign * row[u] > sign * value || (before && row[u] == value)) {
          return false;
        }
      }
    }
  }
  return true;
}

/// Whether it falls off alike to all sides.
bool is_round(const cv::Mat& response, int x, int y) {
  const float* up = response.ptr<float>(y - 1);
  const float* at = response.ptr<float>(y);
  const float* down = response.ptr<float>(y + 1);
  const double xx = at[x - 1] - 2.0 * at[x] + at[x + 1];
  const double yy = up[x] - 2.0 * at[x] + down[x];
  const double xy = 0.25 * (down[x + 1] - down[x - 1] - up[x + 1] + up[x - 1]);
  const double determinant = xx * yy - xy * xy;
  const double trace = xx + yy;
  const double most = (kMostElongation + 1.0) * (kMostElongation + 1.0) / kMostElongation;
  return determinant > 0.0 && trace * trace < most * determinant;
}

/// Adds the spots of one octave. @param scale px of the picture in a px of the octave
void add_spots(const cv::Mat& octave, double scale, std::vector<Spot>& spots) {
  const double ratio = std::pow(2.0, 1.0 / kStepsPerOctave);
  std::array<cv::Mat, kBlurs> blurred;
  std::array<double, kBlurs> sigma{};
  for (int i = 0; i < kBlurs; ++i) {
    const auto at = static_cast<std::size_t>(i);
    sigma[at] = kFirstSigma_px * std::pow(ratio, i);
    cv::GaussianBlur(octave, blurred[at], {}, sigma[at], sigma[at], cv::BORDER_REFLECT_101);
  }
  std::array<cv::Mat, kBlurs - 1> responses;  // sigma^2 times the Laplacian, negative: bright spots are above 0
  for (std::size_t i = 0; i + 1 < kBlurs; ++i) {
    cv::subtract(blurred[i], blurred[i + 1], responses[i]);
    responses[i] *= 1.0 / (ratio - 1.0);
  }
  for (int level = 1; level <= kStepsPerOctave; ++level) {
    const cv::Mat& response = responses[static_cast<std::size_t>(level)];
    for (int y = 1; y + 1 < response.rows; ++y) {
      const float* row = response.ptr<float>(y);
      for (int x = 1; x + 1 < response.cols; ++x) {
        if (std::abs(row[x]) < kLeastResponse || !is_extreme(responses, level, x, y, row[x])) continue;
        if (!is_round(response, x, y)) continue;
        // The difference of two blurs answers to the size between theirs.
        const double middle_sigma = sigma[static_cast<std::size_t>(level)] * std::sqrt(ratio);
        spots.push_back({.place_px = scale * Eigen::Vector2d(x + 0.5, y + 0.5),
                         .diameter_px = scale * kDiameterPerSigma * middle_sigma,
                         .response = std::abs(row[x]),
                         .polarity = row[x] > 0.0f ? MarkerPolarity::kBright : MarkerPolarity::kDark});
      }
    }
  }
}

std::vector<Spot> find_spots(const cv::Mat& brightness, double scale) {
  cv::Mat octave;
  brightness.convertTo(octave, CV_32F);
  octave += kLightFloor;
  cv::log(octave, octave);
  std::vector<Spot> spots;
  while (std::min(octave.rows, octave.cols) >= kLeastSide_px) {
    add_spots(octave, scale, spots);
    cv::Mat half;
    cv::resize(octave, half, {octave.cols / 2, octave.rows / 2}, 0.0, 0.0, cv::INTER_AREA);
    octave = half;
    scale *= 2.0;
  }
  return spots;
}

/// Spots alike in size and contrast.
struct Kind {
  std::vector<Spot> spots;
  double evidence = 0.0;
};

/// Of one sign, those of about this size. None if there are fewer than kLeastMarkers.
Kind kind_of(const std::vector<Spot>& spots, MarkerPolarity polarity, double size_px) {
  Kind kind;
  std::vector<double> responses;
  for (const Spot& spot : spots) {
    const bool alike = spot.diameter_px <= kSizeSpread * size_px && spot.diameter_px * kSizeSpread >= size_px;
    if (spot.polarity != polarity || !alike) continue;
    kind.spots.push_back(spot);
    responses.push_back(spot.response);
  }
  // The usual response is that of the upper quarter: noise may give more spots than there are markers.
  const auto quarter = responses.begin() + static_cast<std::ptrdiff_t>(responses.size() * 3 / 4);
  std::nth_element(responses.begin(), quarter, responses.end());
  const double least = kContrastSpread * *quarter;
  std::erase_if(kind.spots, [&](const Spot& spot) { return spot.response < least; });
  if (static_cast<int>(kind.spots.size()) < kLeastMarkers) kind.spots.clear();
  // Squares: a thousand specks of noise have less together than a hundred markers. Times the size: a few dark grains of
  // dust have less than faint dots, whose many pixels say the same.
  for (const Spot& spot : kind.spots) kind.evidence += spot.response * spot.response * spot.diameter_px;
  return kind;
}

/// The most evident one comes first.
std::vector<Kind> kinds_of(const std::vector<Spot>& spots) {
  std::vector<Kind> kinds;
  for (const MarkerPolarity polarity : {MarkerPolarity::kDark, MarkerPolarity::kBright}) {
    std::vector<double> sizes;
    for (const Spot& spot : spots) {
      if (spot.polarity == polarity) sizes.push_back(spot.diameter_px);
    }
    std::sort(sizes.begin(), sizes.end());
    sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());  // there are few: one for each blur
    for (const double size : sizes) {
      Kind kind = kind_of(spots, polarity, size);
      if (!kind.spots.empty()) kinds.push_back(std::move(kind));
    }
  }
  std::stable_sort(kinds.begin(), kinds.end(), [](const Kind& a, const Kind& b) { return a.evidence > b.evidence; });
  return kinds;
}

double median_to_nearest(const std::vector<Spot>& spots) {
  std::vector<double> distances;
  for (const Spot& spot : spots) {
    double least = std::numeric_limits<double>::infinity();
    for (const Spot& other : spots) {
      if (&other != &spot) least = std::min(least, (other.place_px - spot.place_px).norm());
    }
    distances.push_back(least);
  }
  return median(std::move(distances));
}

/// The mean of a square's part within the picture; `sums` are OpenCV's integral.
double mean_round(const cv::Mat& sums, const Eigen::Vector2d& place_px, double reach_px) {
  const int left = std::max(static_cast<int>(std::lround(place_px.x() - reach_px)), 0);
  const int top = std::max(static_cast<int>(std::lround(place_px.y() - reach_px)), 0);
  const int right = std::min(std::max(static_cast<int>(std::lround(place_px.x() + reach_px)), left + 1), sums.cols - 1);
  const int bottom = std::min(std::max(static_cast<int>(std::lround(place_px.y() + reach_px)), top + 1), sums.rows - 1);
  if (right <= left || bottom <= top) return 0.0;
  const double sum = sums.at<double>(bottom, right) - sums.at<double>(top, right) - sums.at<double>(bottom, left) +
                     sums.at<double>(top, left);
  return sum / (static_cast<double>(right - left) * (bottom - top));
}

/// The threshold half way between the markers and what MarkerFinder compares them with.
void set_threshold(const std::vector<Spot>& kind, const cv::Mat& brightness, MarkerAppearance& appearance) {
  constexpr double kCore = 0.2;                 ///< of the diameter, to each side: a marker without its rim
  constexpr double kPartOfDifference = 0.3;     ///< so many grey levels a blob needs at least, of a faint marker's
  constexpr double kFaint = 0.1;                ///< quantile
  constexpr double kLeast = 2.0, kMost = 10.0;  ///< grey levels: noise, and what any marker has
  cv::Mat sums;
  cv::integral(brightness, sums, CV_64F);
  const bool is_dark = appearance.polarity == MarkerPolarity::kDark;
  GelBrightness gel;
  if (is_dark) gel.read(brightness, appearance.diameter_px);
  std::vector<double> ratios, differences;
  for (const Spot& spot : kind) {
    const double core = mean_round(sums, spot.place_px, kCore * appearance.diameter_px);
    double other = 0.0;
    if (is_dark) {
      const int x = std::clamp(static_cast<int>(spot.place_px.x()), 0, brightness.cols - 1);
      const int y = std::clamp(static_cast<int>(spot.place_px.y()), 0, brightness.rows - 1);
      other = gel.row(y)[x / gel.block_px()];
    } else {
      other = mean_round(sums, spot.place_px, 0.75 * appearance.spacing_px);
    }
    const auto [low, high] = std::minmax(core, other);
    ratios.push_back(high > 0.0 ? low / high : 1.0);
    differences.push_back(high - low);
  }
  appearance.darkness = std::clamp(0.5 * (1.0 + median(ratios)), 0.1, 0.99);
  const auto faint =
      differences.begin() + static_cast<std::ptrdiff_t>(kFaint * static_cast<double>(differences.size()));
  std::nth_element(differences.begin(), faint, differences.end());
  appearance.least_difference = std::clamp(kPartOfDifference * *faint, kLeast, kMost);
}

MarkerAppearance appearance_of(const std::vector<Spot>& kind, const cv::Mat& brightness) {
  MarkerAppearance appearance;
  appearance.polarity = kind.front().polarity;
  std::vector<double> sizes;
  for (const Spot& spot : kind) sizes.push_back(spot.diameter_px);
  appearance.diameter_px = std::clamp(median(std::move(sizes)), 2.0, 256.0);
  appearance.spacing_px = std::clamp(median_to_nearest(kind), appearance.diameter_px, 1024.0);
  set_threshold(kind, brightness, appearance);
  return appearance;
}

/// Whether most spots are blobs, too. The four corners of a gel before a black housing are spots, but no blobs.
bool is_confirmed(const std::vector<Spot>& kind, const cv::Mat& brightness, const MarkerAppearance& appearance) {
  constexpr double kLeastBlobs = 0.5;  // of the spots
  constexpr double kAreaSpread = 3.0;  // of a disc of the diameter, which is known to a step of size only
  if (std::min(brightness.rows, brightness.cols) < appearance.spacing_px) return false;
  MarkerFinder finder(appearance);
  const double disc_px = 0.25 * std::numbers::pi * appearance.diameter_px * appearance.diameter_px;
  int blobs = 0;
  for (const MarkerBlob& blob : finder.find(brightness)) {
    const bool alike = blob.area_px <= kAreaSpread * disc_px && blob.area_px * kAreaSpread >= disc_px;
    blobs += alike && !blob.at_border && is_compact(blob) ? 1 : 0;
  }
  return blobs >= kLeastMarkers && blobs >= kLeastBlobs * static_cast<double>(kind.size());
}

}  // namespace

MarkerAppearance learn_appearance(const cv::Mat& rest) {
  cv::Mat brightness;
  const FrameLight light = marker_brightness(rest, brightness);
  if (light != FrameLight::kNormal) fail("markers: the frame at rest is {}", name_of(light));
  cv::Mat small = brightness;
  double scale = 1.0;
  while (std::max(small.rows, small.cols) > kMostSide_px) {
    cv::Mat half;
    cv::resize(small, half, {small.cols / 2, small.rows / 2}, 0.0, 0.0, cv::INTER_AREA);
    small = half;
    scale *= 2.0;
  }
  for (const Kind& kind : kinds_of(find_spots(small, scale))) {
    const MarkerAppearance appearance = appearance_of(kind.spots, brightness);
    if (is_confirmed(kind.spots, brightness, appearance)) return appearance;
  }
  fail("markers: the frame at rest shows none: no {} spots of one size stand out in it", kLeastMarkers);
}

}  // namespace touchstone::sensors
