#include "sensors/heights/frame_gain.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "sensors/numerics/quantile.h"

namespace touchstone::sensors {
namespace {

constexpr int kWindow = 7;             // px: means over it, since noise moves a dark pixel by more than kAlike
constexpr int kAsked = 20000;          // pixels of a frame
constexpr float kDarkest_DN = 8.0F;    // a darker background has no ratio
constexpr float kWhitest_DN = 250.0F;  // means above it hold pixels that are cut off
constexpr float kBrightest_DN = 200.0F;
constexpr double kLeastCounting = 0.3;  // of the pixels count however bright they are
constexpr int kBins = 1000;             // of the ratio's logarithm,
constexpr float kWidest = 1.0F;         // from -1 to 1: gains of 0.37 to 2.7
constexpr float kBlur_bins = 5.0F;
constexpr float kAlike = 0.08F;
constexpr int kTooFew = 50;

}  // namespace

GainFinder::GainFinder(const Background& background) : size_(background.mean.size()) {
  TS_ASSERT(background.mean.type() == CV_32FC3);
  cv::Mat mean;
  cv::boxFilter(background.mean, mean, CV_32F, {kWindow, kWindow});
  std::array<float, 3> limit{};
  for (int c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (int v = 0; v < mean.rows; ++v) {
      for (int u = 0; u < mean.cols; ++u) values.push_back(mean.at<cv::Vec3f>(v, u)[c]);
    }
    limit[static_cast<std::size_t>(c)] = std::max(kBrightest_DN, quantile_of(values, kLeastCounting));
  }
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(mean.total()) / kAsked))));
  for (int v = step / 2; v < mean.rows; v += step) {
    for (int u = step / 2; u < mean.cols; u += step) {
      const auto& rest = mean.at<cv::Vec3f>(v, u);
      Sample sample{u, v};
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = rest[static_cast<int>(c)];
        sample.log_rest[c] = std::log(std::max(value, kDarkest_DN));
        sample.counts[c] = value >= kDarkest_DN && value <= limit[c];
      }
      samples_.push_back(sample);
    }
  }
  logs_.resize(samples_.size());
  alike_.resize(samples_.size());
  constexpr int kHalf = 15;
  for (int i = -kHalf; i <= kHalf; ++i) {
    kernel_.push_back(std::exp(-0.5F * static_cast<float>(i * i) / (kBlur_bins * kBlur_bins)));
  }
  histogram_.resize(kBins);
  smooth_.resize(kBins);
}

double GainFinder::commonest() {
  const int half = static_cast<int>(kernel_.size()) / 2;
  for (int i = 0; i < kBins; ++i) {
    float sum = 0.0F;
    for (int j = std::max(0, i - half); j <= std::min(kBins - 1, i + half); ++j) {
      sum += kernel_[static_cast<std::size_t>(j - i + half)] * histogram_[static_cast<std::size_t>(j)];
    }
    smooth_[static_cast<std::size_t>(i)] = sum;
  }
  const auto peak = static_cast<std::size_t>(std::max_element(smooth_.begin(), smooth_.end()) - smooth_.begin());
  double shift = 0.0;  // of the parabola through the three bins about it
  if (peak > 0 && peak + 1 < smooth_.size()) {
    const auto left = static_cast<double>(smooth_[peak - 1]);
    const auto right = static_cast<double>(smooth_[peak + 1]);
    const double bend = left - 2.0 * static_cast<double>(smooth_[peak]) + right;
    if (bend < 0.0) shift = 0.5 * (left - right) / bend;
  }
  return (static_cast<double>(peak) + 0.5 + shift) * (2.0 * static_cast<double>(kWidest) / kBins) -
         static_cast<double>(kWidest);
}

FrameGain GainFinder::find(const cv::Mat& frame) {
  TS_ASSERT(frame.type() == CV_8UC3 && frame.size() == size_);
  cv::boxFilter(frame, smooth_frame_, CV_32F, {kWindow, kWindow});
  FrameGain found;
  std::fill(alike_.begin(), alike_.end(), static_cast<unsigned char>(1));
  for (std::size_t c = 0; c < 3; ++c) {
    const auto channel = static_cast<int>(c);
    std::fill(histogram_.begin(), histogram_.end(), 0.0F);
    int count = 0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Sample& sample = samples_[i];
      const float value = smooth_frame_.at<cv::Vec3f>(sample.v, sample.u)[channel];
      logs_[i] = std::log(std::max(value, kDarkest_DN)) - sample.log_rest[c];
      if (!sample.counts[c] || value < kDarkest_DN || value > kWhitest_DN) continue;
      const auto bin = static_cast<int>((logs_[i] + kWidest) * (kBins / (2.0F * kWidest)));
      if (bin < 0 || bin >= kBins) continue;
      histogram_[static_cast<std::size_t>(bin)] += 1.0F;
      ++count;
    }
    const double log_gain = count < kTooFew ? 0.0 : commonest();
    found.gain[channel] = std::exp(log_gain);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Sample& sample = samples_[i];
      // What rest and gain make too dark can't be judged.
      if (sample.log_rest[c] + static_cast<float>(std::min(log_gain, 0.0)) <= std::log(kDarkest_DN)) continue;
      const float off = logs_[i] - static_cast<float>(log_gain);
      const bool cut = smooth_frame_.at<cv::Vec3f>(sample.v, sample.u)[channel] > kWhitest_DN;
      if (std::abs(off) > kAlike && !(cut && off < 0.0F)) alike_[i] = 0;
    }
  }
  found.alike = static_cast<double>(std::count(alike_.begin(), alike_.end(), static_cast<unsigned char>(1))) /
                static_cast<double>(samples_.size());
  return found;
}

}  // namespace touchstone::sensors
