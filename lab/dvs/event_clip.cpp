#include "lab/dvs/event_clip.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace touchstone::lab {
namespace {

constexpr int kFrames = 100;  // of one period
constexpr double kBright = 100.0;
constexpr double kDark = 1e-3;
constexpr double kTwoPi = 2.0 * kPi;

double phase_of(int x, int y) {
  return 0.05 * x + 0.03 * y;
}

double light_of(double phase) {
  return kBright * (1.0 + 0.5 * std::sin(phase));
}

}  // namespace

std::vector<cv::Mat> event_clip() {
  std::vector<cv::Mat> all;
  for (int frame = 0; frame < kFrames; ++frame) {
    cv::Mat image(kEventClipHeight, kEventClipWidth, CV_32FC1);
    for (int y = 0; y < kEventClipHeight; ++y) {
      for (int x = 0; x < kEventClipWidth; ++x) {
        image.at<float>(y, x) = static_cast<float>(light_of(phase_of(x, y) + kTwoPi * frame / kFrames));
      }
    }
    all.push_back(image);
  }
  return all;
}

render::EventPixelSettings event_clip_ideal() {
  render::EventPixelSettings settings;
  settings.dark_intensity = kDark;
  return settings;
}

render::EventPixelSettings event_clip_noisy() {
  render::EventPixelSettings settings = event_clip_ideal();
  settings.threshold_spread = 0.03;
  settings.bandwidth_hz = 300.0;
  settings.reference_intensity = kBright;
  settings.refractory_us = 500;
  settings.leak_rate_hz = 0.1;
  settings.shot_rate_hz = 5.0;
  settings.shot_half_intensity = kBright / 3.0;
  return settings;
}

double event_clip_count(std::int64_t last_frame, double threshold) {
  double total = 0.0;
  for (int y = 0; y < kEventClipHeight; ++y) {
    for (int x = 0; x < kEventClipWidth; ++x) {
      const double begin = phase_of(x, y);
      const double end = begin + kTwoPi * static_cast<double>(last_frame) / kFrames;
      double level = std::log(light_of(begin) + kDark);
      double turn = kPi * (std::floor(begin / kPi - 0.5) + 1.5);
      for (;;) {
        const double to = std::log(light_of(std::min(turn, end)) + kDark);
        const double count = std::floor(std::abs(to - level) / threshold);
        level += std::copysign(count * threshold, to - level);
        total += count;
        if (turn >= end) break;
        turn += kPi;
      }
    }
  }
  return total;
}

}  // namespace touchstone::lab
