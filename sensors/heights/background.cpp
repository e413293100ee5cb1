#include "sensors/heights/background.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr double kMostSaturated = 0.01;

}  // namespace

std::string frame_fault(const cv::Mat& frame, const cv::Size& size) {
  if (frame.empty()) return "is empty";
  if (frame.channels() == 1)
    return "is grey; slopes in two directions can't be estimated from one brightness: colour is needed";
  if (frame.channels() != 3) return fmt::format("has {} channels; 3 (BGR) are needed", frame.channels());
  if (frame.depth() != CV_8U) return "isn't of 8 bits a channel";
  if (!size.empty() && frame.size() != size) {
    return fmt::format("is {} x {} px; the background is {} x {}", frame.cols, frame.rows, size.width, size.height);
  }
  return {};
}

double saturated_share(const cv::Mat& frame) {
  TS_ASSERT(frame.type() == CV_8UC3);
  std::int64_t count = 0;
  for (int v = 0; v < frame.rows; ++v) {
    const auto* row = frame.ptr<cv::Vec3b>(v);
    count += std::count_if(row, row + frame.cols, [](const cv::Vec3b& pixel) { return saturated_channels(pixel) > 0; });
  }
  return static_cast<double>(count) / static_cast<double>(frame.total());
}

Background mean_background(std::span<const cv::Mat> frames) {
  if (frames.empty()) fail("no background: at least one frame of the untouched gel is needed");
  Background background;
  cv::Mat sum;
  cv::Mat squares;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string fault = frame_fault(frames[i], sum.size());
    if (!fault.empty()) fail("background frame {}: {}", i + 1, fault);
    if (const double share = saturated_share(frames[i]); share > kMostSaturated) {
      fail("background frame {}: {:.1f} % of its pixels are saturated; at most {:.0f} % may be", i + 1, 100.0 * share,
           100.0 * kMostSaturated);
    }
    cv::Mat values;
    frames[i].convertTo(values, CV_64F);
    if (sum.empty()) {
      sum = cv::Mat::zeros(values.size(), CV_64FC3);
      squares = sum.clone();
    }
    sum += values;
    squares += values.mul(values);
  }
  const auto count = static_cast<double>(frames.size());
  cv::Mat(sum / count).convertTo(background.mean, CV_32F);
  background.frames = static_cast<int>(frames.size());
  if (frames.size() >= 2) {
    const cv::Mat scatter = squares - sum.mul(sum) / count;
    const cv::Scalar variance = cv::mean(scatter) / (count - 1.0);
    cv::Vec3d noise;
    for (int c = 0; c < 3; ++c) noise[c] = std::sqrt(std::max(variance[c], 0.0));
    background.noise_DN = noise;
  }
  return background;
}

cv::Mat difference_to(const Background& background, const cv::Mat& frame, const cv::Vec3d& gain, double ceiling_DN) {
  TS_ASSERT(background.mean.type() == CV_32FC3);
  const std::string fault = frame_fault(frame, background.mean.size());
  if (!fault.empty()) fail("the frame {}", fault);
  cv::Mat difference;
  frame.convertTo(difference, CV_32F);
  if (gain != cv::Vec3d(1.0, 1.0, 1.0)) {
    cv::multiply(difference, cv::Scalar(1.0 / gain[0], 1.0 / gain[1], 1.0 / gain[2]), difference);
  }
  if (!std::isfinite(ceiling_DN)) {
    difference -= background.mean;
    return difference;
  }
  const cv::Scalar ceiling = cv::Scalar::all(ceiling_DN);
  cv::Mat rest;
  cv::min(difference, ceiling, difference);
  cv::min(background.mean, ceiling, rest);
  difference -= rest;
  return difference;
}

}  // namespace touchstone::sensors
