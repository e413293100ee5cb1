#include "sensors/heights/frame_gain.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kAsked = 20000;         // pixels of a frame
constexpr float kDarkest_DN = 10.0F;  // a darker background has no ratio
constexpr float kBrightest_DN = 200.0F;
constexpr double kLeastCounting = 0.3;  // of the pixels count however bright they are
constexpr int kBins = 400;              // of the ratio's logarithm,
constexpr float kWidest = 1.0F;         // from -1 to 1: gains of 0.37 to 2.7
constexpr float kBlur_bins = 4.0F;
constexpr float kWindow = 0.04F;  // of the mean round the commonest
constexpr float kAlike = 0.08F;
constexpr int kTooFew = 50;

float quantile(std::vector<float> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

GainFinder::GainFinder(const Background& background) {
  const cv::Mat& mean = background.mean;
  TS_ASSERT(mean.type() == CV_32FC3);
  std::array<float, 3> limit{};
  for (int c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (int v = 0; v < mean.rows; ++v) {
      for (int u = 0; u < mean.cols; ++u) values.push_back(mean.at<cv::Vec3f>(v, u)[c]);
    }
    limit[static_cast<std::size_t>(c)] = std::max(kBrightest_DN, quantile(std::move(values), kLeastCounting));
  }
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(mean.total()) / kAsked))));
  for (int v = step / 2; v < mean.rows; v += step) {
    for (int u = step / 2; u < mean.cols; u += step) {
      const auto& rest = mean.at<cv::Vec3f>(v, u);
      Sample sample{u, v};
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = rest[static_cast<int>(c)];
        sample.log_rest[c] = std::log(std::max(value, kDarkest_DN));
        sample.counts[c] = value > kDarkest_DN && value <= limit[c];
      }
      samples_.push_back(sample);
    }
  }
  for (int value = 0; value < 256; ++value) logs_.push_back(std::log(std::max(static_cast<float>(value), 1.0F)));
  for (int i = -12; i <= 12; ++i) {
    kernel_.push_back(std::exp(-0.5F * static_cast<float>(i * i) / (kBlur_bins * kBlur_bins)));
  }
  histogram_.resize(kBins);
  smooth_.resize(kBins);
}

FrameGain GainFinder::find(const cv::Mat& frame) {
  TS_ASSERT(frame.type() == CV_8UC3);
  FrameGain found;
  std::array<float, 3> log_gain{};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto channel = static_cast<int>(c);
    const auto for_each_ratio = [&](auto use) {
      for (const Sample& sample : samples_) {
        const unsigned char value = frame.at<cv::Vec3b>(sample.v, sample.u)[channel];
        if (sample.counts[c] && value > 0 && value < 255) use(logs_[value] - sample.log_rest[c]);
      }
    };
    std::fill(histogram_.begin(), histogram_.end(), 0.0F);
    int count = 0;
    for_each_ratio([&](float ratio) {
      const auto bin = static_cast<int>((ratio + kWidest) * (kBins / (2.0F * kWidest)));
      if (bin < 0 || bin >= kBins) return;
      histogram_[static_cast<std::size_t>(bin)] += 1.0F;
      ++count;
    });
    if (count < kTooFew) continue;  // a gain of 1
    const int half = static_cast<int>(kernel_.size()) / 2;
    for (int i = 0; i < kBins; ++i) {
      float sum = 0.0F;
      for (int j = std::max(0, i - half); j <= std::min(kBins - 1, i + half); ++j) {
        sum += kernel_[static_cast<std::size_t>(j - i + half)] * histogram_[static_cast<std::size_t>(j)];
      }
      smooth_[static_cast<std::size_t>(i)] = sum;
    }
    const auto peak = std::max_element(smooth_.begin(), smooth_.end()) - smooth_.begin();
    double at = (static_cast<double>(peak) + 0.5) * (2.0 * kWidest / kBins) - kWidest;
    for (int pass = 0; pass < 3; ++pass) {
      double sum = 0.0;
      double near = 0.0;
      for_each_ratio([&](float ratio) {
        const bool within = std::abs(ratio - static_cast<float>(at)) < kWindow;
        sum += within ? static_cast<double>(ratio) : 0.0;
        near += within ? 1.0 : 0.0;
      });
      if (near > 0.0) at = sum / near;
    }
    log_gain[c] = static_cast<float>(at);
    found.gain[channel] = std::exp(at);
  }
  int alike = 0;
  for (const Sample& sample : samples_) {
    const auto& pixel = frame.at<cv::Vec3b>(sample.v, sample.u);
    bool all = true;
    for (std::size_t c = 0; c < 3; ++c) {
      const unsigned char value = pixel[static_cast<int>(c)];
      const float off = logs_[value] - log_gain[c] - sample.log_rest[c];
      all = all && (std::abs(off) < kAlike || (value == 255 && off < 0.0F));  // or cut off
    }
    alike += all ? 1 : 0;
  }
  found.alike = static_cast<double>(alike) / static_cast<double>(samples_.size());
  return found;
}

}  // namespace touchstone::sensors
