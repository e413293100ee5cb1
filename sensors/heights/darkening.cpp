#include "sensors/heights/darkening.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/wide_clones.h"
#include "sensors/numerics/quantile.h"

namespace touchstone::sensors {
namespace {

constexpr double kMostSaturated = 0.01;
constexpr double kLeastLit = 0.5;
constexpr double kBorderPart = 0.02;        // of the smaller side: how wide the border is
constexpr float kMostDisagreement = 0.06F;  // between the border's quartiles: beyond, no one exposure explains it
constexpr double kLargestExposure = 4.0;

/// Wrong number of bits or channels, or the empty string.
std::string wrong_kind(const cv::Mat& frame) {
  if (frame.empty()) return "is empty";
  if (frame.depth() != CV_8U) return "isn't of 8 bits a channel";
  if (frame.channels() != 1 && frame.channels() != 3) {
    return fmt::format("has {} channels; 1 (grey) or 3 (BGR) are needed", frame.channels());
  }
  return {};
}

/// The mean of the channels, CV_64FC1.
cv::Mat brightness_of(const cv::Mat& frame) {
  cv::Mat wide;
  frame.convertTo(wide, CV_64F);
  cv::Mat brightness;
  cv::transform(wide, brightness, cv::Mat(1, frame.channels(), CV_64F, cv::Scalar(1.0 / frame.channels())));
  return brightness;
}

/// The share of pixels with a channel at 255.
double share_at_255(const cv::Mat& frame) {
  std::int64_t count = 0;
  for (int v = 0; v < frame.rows; ++v) {
    const auto* pixel = frame.ptr<unsigned char>(v);
    for (int u = 0; u < frame.cols; ++u, pixel += frame.channels()) {
      count += std::any_of(pixel, pixel + frame.channels(), [](unsigned char c) { return c == 255; }) ? 1 : 0;
    }
  }
  return static_cast<double>(count) / static_cast<double>(frame.total());
}

struct Extremes {
  int saturated = 0;
  int dark = 0;
};

TS_WIDE_CLONES Extremes add_channels(const unsigned char* blue, const unsigned char* green, const unsigned char* red,
                                     int count, float* sum, unsigned char* saturated) {
  Extremes extremes;
  for (int u = 0; u < count; ++u) {
    const int together = blue[u] + green[u] + red[u];
    const int over = (blue[u] == 255) | (green[u] == 255) | (red[u] == 255) ? 255 : 0;
    sum[u] = static_cast<float>(together);
    saturated[u] = static_cast<unsigned char>(over);
    extremes.saturated += over & 1;
    extremes.dark += together == 0 ? 1 : 0;
  }
  return extremes;
}

TS_WIDE_CLONES Extremes take_channel(const unsigned char* grey, int count, float* sum, unsigned char* saturated) {
  Extremes extremes;
  for (int u = 0; u < count; ++u) {
    sum[u] = static_cast<float>(grey[u]);
    saturated[u] = grey[u] == 255 ? 255 : 0;
    extremes.saturated += grey[u] == 255 ? 1 : 0;
    extremes.dark += grey[u] == 0 ? 1 : 0;
  }
  return extremes;
}

TS_WIDE_CLONES void darken(const float* sum, const float* inverse, const float* lit, float factor, int count,
                           float* darkening) {
  for (int u = 0; u < count; ++u) darkening[u] = lit[u] - factor * (sum[u] * inverse[u]);
}

}  // namespace

std::string unfit_frame(const cv::Mat& frame, const RestPicture& rest) {
  if (std::string fault = wrong_kind(frame); !fault.empty()) return fault;
  if (frame.size() != rest.mean.size()) {
    return fmt::format("is {} x {} px; the rest picture is {} x {}: is it another sensor's?", frame.cols, frame.rows,
                       rest.mean.cols, rest.mean.rows);
  }
  if (frame.channels() != rest.channels) {
    const auto kind = [](int channels) { return channels == 1 ? "grey" : "in colour"; };
    return fmt::format("is {}; the rest picture is {}: both must be of one kind", kind(frame.channels()),
                       kind(rest.channels));
  }
  return {};
}

RestPicture mean_rest(std::span<const cv::Mat> frames) {
  if (frames.empty()) fail("no rest picture: at least one frame of the untouched gel is needed");
  RestPicture rest;
  cv::Mat sum;
  cv::Mat squares;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const cv::Mat& frame = frames[i];
    const std::string fault = i == 0 ? wrong_kind(frame) : unfit_frame(frame, rest);
    if (!fault.empty()) fail("rest frame {}: the frame {}", i + 1, fault);
    if (const double share = share_at_255(frame); share > kMostSaturated) {
      fail("rest frame {}: {:.1f} % of its pixels are saturated; at most {:.0f} % may be: lower exposure or gain",
           i + 1, 100.0 * share, 100.0 * kMostSaturated);
    }
    if (i == 0) {
      rest.mean = cv::Mat::zeros(frame.size(), CV_32FC1);
      rest.channels = frame.channels();
      sum = cv::Mat::zeros(frame.size(), CV_64FC1);
      squares = sum.clone();
    }
    const cv::Mat brightness = brightness_of(frame);
    sum += brightness;
    squares += brightness.mul(brightness);
  }
  const auto count = static_cast<double>(frames.size());
  cv::Mat(sum / count).convertTo(rest.mean, CV_32F);
  rest.frames = static_cast<int>(frames.size());
  if (frames.size() >= 2) {
    const cv::Mat scatter = squares - sum.mul(sum) / count;
    rest.noise_DN = std::sqrt(std::max(cv::mean(scatter)[0] / (count - 1.0), 0.0));
  }
  const double lit = cv::countNonZero(rest.mean >= kDarkestRest_DN) / static_cast<double>(rest.mean.total());
  if (lit < kLeastLit) {
    fail(
        "the rest picture: only {:.0f} % of it is brighter than {:.0f} DN; at least {:.0f} % must be: are the lamps "
        "on?",
        100.0 * lit, kDarkestRest_DN, 100.0 * kLeastLit);
  }
  return rest;
}

DarkeningMeter::DarkeningMeter(const RestPicture& rest, const DarkeningSettings& settings)
    : rest_(rest), settings_(settings) {
  TS_ASSERT(rest.mean.type() == CV_32FC1 && !rest.mean.empty() && settings.smoothing_px >= 0.0);
  const cv::Size size = rest.mean.size();
  inverse_.create(size, CV_32FC1);
  lit_.create(size, CV_32FC1);
  unlit_.create(size, CV_8UC1);
  const int wide = std::max(2, static_cast<int>(kBorderPart * std::min(size.width, size.height)));
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const float brightness = rest.mean.at<float>(v, u);
      const bool lit = brightness >= kDarkestRest_DN;
      inverse_.at<float>(v, u) = lit ? 1.0F / (static_cast<float>(rest.channels) * brightness) : 0.0F;
      lit_.at<float>(v, u) = lit ? 1.0F : 0.0F;
      unlit_.at<unsigned char>(v, u) = lit ? 0 : 255;
      const int inward = std::min({u, v, size.width - 1 - u, size.height - 1 - v});
      if (lit && inward < wide) border_.push_back(v * size.width + u);
    }
  }
  for (cv::Mat& plane : planes_) plane.create(size, CV_8UC1);
  sum_.create(size, CV_32FC1);
  result_.map.create(size, CV_32FC1);
  result_.saturated.create(size, CV_8UC1);
}

void DarkeningMeter::follow_exposure() {
  result_.exposure = 1.0;
  result_.exposure_followed = false;
  if (!settings_.follow_exposure) return;
  ratios_.clear();
  const auto* sum = sum_.ptr<float>();
  const auto* inverse = inverse_.ptr<float>();
  const auto* saturated = result_.saturated.ptr<unsigned char>();
  for (const int pixel : border_) {
    if (saturated[pixel] == 0) ratios_.push_back(sum[pixel] * inverse[pixel]);
  }
  if (2 * ratios_.size() < border_.size() || ratios_.empty()) return;
  const float middle = quantile_of(ratios_, 0.5);
  const float apart = quantile_of(ratios_, 0.75) - quantile_of(ratios_, 0.25);
  if (!(apart <= kMostDisagreement * middle)) return;
  if (!(middle <= kLargestExposure && middle >= 1.0 / kLargestExposure)) return;
  result_.exposure = static_cast<double>(middle);
  result_.exposure_followed = true;
}

const Darkening& DarkeningMeter::measure(const cv::Mat& frame) {
  if (const std::string fault = unfit_frame(frame, rest_); !fault.empty()) fail("the frame {}", fault);
  const int width = frame.cols;
  Extremes extremes;
  if (rest_.channels == 3) cv::split(frame, planes_);
  for (int v = 0; v < frame.rows; ++v) {
    auto* const sum = sum_.ptr<float>(v);
    auto* const saturated = result_.saturated.ptr(v);
    const Extremes here = rest_.channels == 3 ? add_channels(planes_[0].ptr(v), planes_[1].ptr(v), planes_[2].ptr(v),
                                                             width, sum, saturated)
                                              : take_channel(frame.ptr(v), width, sum, saturated);
    extremes.saturated += here.saturated;
    extremes.dark += here.dark;
  }
  const auto pixels = static_cast<double>(frame.total());
  result_.saturated_share = extremes.saturated / pixels;
  result_.dark_share = extremes.dark / pixels;
  follow_exposure();
  const auto factor = static_cast<float>(1.0 / result_.exposure);
  for (int v = 0; v < frame.rows; ++v) {
    darken(sum_.ptr<float>(v), inverse_.ptr<float>(v), lit_.ptr<float>(v), factor, width, result_.map.ptr<float>(v));
  }
  if (settings_.smoothing_px > 0.0) {
    const int reach = static_cast<int>(std::ceil(3.0 * settings_.smoothing_px));
    cv::GaussianBlur(result_.map, result_.map, {2 * reach + 1, 2 * reach + 1}, settings_.smoothing_px);
  }
  return result_;
}

}  // namespace touchstone::sensors
