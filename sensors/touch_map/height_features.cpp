#include "sensors/touch_map/height_features.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kFrame_px = 32;  // more than BRISK's pattern reaches
constexpr double kMiddleGrey = 128.0;

}  // namespace

cv::Mat grey_of(const ReliefDetail& detail, const FeatureSettings& settings) {
  cv::Mat grey;
  evened(detail, settings.rms_over_mm, settings.least_rms_mm)
      .convertTo(grey, CV_8U, 127.0 / settings.grey_range_rms, kMiddleGrey);
  return grey;
}

HeightFeatureDetector::HeightFeatureDetector(const FeatureSettings& settings) : settings_(settings) {
  if (settings.threshold < 1 || settings.threshold > 255) {
    fail("the features' threshold is {}; allowed is 1 to 255", settings.threshold);
  }
  if (settings.octaves < 0 || settings.octaves > 8) {
    fail("the features have {} octaves; allowed is 0 to 8", settings.octaves);
  }
  if (!(settings.pattern_scale >= 0.2 && settings.pattern_scale <= 5.0)) {
    fail("the features' pattern_scale is {}; allowed is 0.2 to 5", settings.pattern_scale);
  }
  if (!(settings.grey_range_rms > 0.0) || !(settings.least_rms_mm > 0.0)) {
    fail("the features' grey range ({} rms, at least {} mm) must be above 0", settings.grey_range_rms,
         settings.least_rms_mm);
  }
  brisk_ = cv::BRISK::create(settings.threshold, settings.octaves, static_cast<float>(settings.pattern_scale));
}

HeightFeatures HeightFeatureDetector::detect(const ReliefDetail& detail) const {
  // Grey beyond the border as well: BRISK leaves out what its pattern doesn't fit round.
  const double scale = detail.frame.mm_per_px / settings_.pitch_mm;
  const auto prepared = [&](const cv::Mat& image, int interpolation, double fill) {
    cv::Mat resized, framed;
    const cv::Size size(std::max(1, static_cast<int>(std::lround(image.cols * scale))),
                        std::max(1, static_cast<int>(std::lround(image.rows * scale))));
    cv::resize(image, resized, size, 0.0, 0.0, interpolation);
    cv::copyMakeBorder(resized, framed, kFrame_px, kFrame_px, kFrame_px, kFrame_px, cv::BORDER_CONSTANT, fill);
    return framed;
  };
  const cv::Mat grey = prepared(grey_of(detail, settings_), cv::INTER_AREA, kMiddleGrey);
  const cv::Mat mask = prepared(detail.weight > 0.0, cv::INTER_NEAREST, 0.0);
  std::vector<cv::KeyPoint> found;
  cv::Mat bits;
  brisk_->detectAndCompute(grey, mask, found, bits);
  TS_ASSERT(found.empty() || (bits.type() == CV_8UC1 && bits.cols == sizeof(BinaryDescriptor)));

  std::vector<int> order(found.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  if (order.size() > settings_.most_features) {
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return found[a].response > found[b].response; });
    order.resize(settings_.most_features);
  }
  const Eigen::Vector2d shrink(static_cast<double>(detail.detail_mm.cols) / (grey.cols - 2 * kFrame_px),
                               static_cast<double>(detail.detail_mm.rows) / (grey.rows - 2 * kFrame_px));
  HeightFeatures features;
  for (const int i : order) {
    const Eigen::Vector2d pixel = Eigen::Vector2d(found[i].pt.x, found[i].pt.y).array() - kFrame_px + 0.5;
    features.points.push_back(detail.frame.point_of((pixel.cwiseProduct(shrink).array() - 0.5).matrix()));
    std::memcpy(features.descriptors.emplace_back().data(), bits.ptr(i), sizeof(BinaryDescriptor));
  }
  return features;
}

int hamming_distance(const BinaryDescriptor& a, const BinaryDescriptor& b) {
  int sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::popcount(a[i] ^ b[i]);
  return sum;
}

std::vector<FeatureMatch> match(const HeightFeatures& from, const HeightFeatures& to, const MatchSettings& settings) {
  std::vector<FeatureMatch> result, near;
  for (std::size_t i = 0; i < from.descriptors.size(); ++i) {
    near.clear();
    for (std::size_t j = 0; j < to.descriptors.size(); ++j) {
      const int distance = hamming_distance(from.descriptors[i], to.descriptors[j]);
      if (distance <= settings.most_bits) near.push_back({static_cast<int>(i), static_cast<int>(j), distance});
    }
    const std::size_t kept = std::min(near.size(), static_cast<std::size_t>(std::max(settings.most_partners, 0)));
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), near.end(),
                      [](const FeatureMatch& a, const FeatureMatch& b) {
                        return std::tie(a.distance, a.to) < std::tie(b.distance, b.to);
                      });
    result.insert(result.end(), near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept));
  }
  return result;
}

}  // namespace touchstone::sensors
