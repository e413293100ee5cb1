#include <algorithm>
#include <cfloat>
#include <cmath>

#include "core/error.h"
#include "render/events/event_pixels.h"
#include "render/events/log_photocurrent.h"

namespace touchstone::render {
namespace {

void require(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    fail("event pixels: {} is {}; allowed is a number from {} to {}", name, value, low, high);
  }
}

void require_where(const char* name, double value, const char* needed_by) {
  if (!(value > 0.0 && std::isfinite(value))) {
    fail("event pixels: {} is {}; allowed where {} isn't 0 is a finite number above 0", name, value, needed_by);
  }
}

}  // namespace

void check(const EventPixelSettings& settings) {
  require("on_threshold", settings.on_threshold, kLeastEventThreshold, kLargestEventThreshold);
  require("off_threshold", settings.off_threshold, kLeastEventThreshold, kLargestEventThreshold);
  require("threshold_spread", settings.threshold_spread, 0.0, std::min(settings.on_threshold, settings.off_threshold));
  require("dark_intensity", settings.dark_intensity, 1e-30, 1e18);
  require("bandwidth_hz", settings.bandwidth_hz, 0.0, 1e12);
  if (settings.bandwidth_hz > 0.0) {
    require_where("reference_intensity", settings.reference_intensity, "bandwidth_hz");
  }
  require("refractory_us", static_cast<double>(settings.refractory_us), 0.0, kLongestRefractory_us);
  require("leak_rate_hz", settings.leak_rate_hz, 0.0, kFastestEventRate_hz);
  require("shot_rate_hz", settings.shot_rate_hz, 0.0, kFastestEventRate_hz);
  if (settings.shot_rate_hz > 0.0) {
    require_where("shot_half_intensity", settings.shot_half_intensity, "shot_rate_hz");
  }
}

EventPixelSettings davis240c(double intensity_at_1klux) {
  if (!(intensity_at_1klux >= 1e-20 && intensity_at_1klux <= 1e20)) {
    fail("event pixels: the intensity at 1 klux is {}; allowed is a number from 1e-20 to 1e20", intensity_at_1klux);
  }
  EventPixelSettings settings;
  settings.threshold_spread = 0.035;
  settings.dark_intensity = 1e-4 * intensity_at_1klux;
  settings.bandwidth_hz = 3000.0;
  settings.reference_intensity = intensity_at_1klux;
  settings.refractory_us = 500;
  settings.leak_rate_hz = 0.1;
  settings.shot_rate_hz = 5.0;
  settings.shot_half_intensity = 1e-3 * intensity_at_1klux;
  return settings;
}

cv::Mat log_intensity(const cv::Mat& intensity, const EventPixelSettings& settings) {
  check(settings);
  if (intensity.empty() || intensity.type() != CV_32FC1) {
    fail("event pixels: the picture is {} x {} of OpenCV's type {}; allowed is a picture of type CV_32FC1",
         intensity.cols, intensity.rows, intensity.type());
  }
  cv::Mat logs(intensity.size(), CV_32FC1);
  for (int row = 0; row < intensity.rows; ++row) {
    const float* in = intensity.ptr<float>(row);
    float* out = logs.ptr<float>(row);
    for (int column = 0; column < intensity.cols; ++column) {
      if (!(in[column] >= 0.0F && in[column] <= FLT_MAX)) {
        fail("intensity of pixel (column {}, row {}) is {}; allowed is a finite number from 0", column, row,
             in[column]);
      }
      out[column] = static_cast<float>(std::log(in[column] + settings.dark_intensity));
    }
  }
  return logs;
}

int needed_subdivisions(const cv::Mat& log_before, const cv::Mat& log_after, double largest_change) {
  if (log_before.type() != CV_32FC1 || log_after.type() != CV_32FC1 || log_before.size() != log_after.size()) {
    fail(
        "logarithms of {} x {} of OpenCV's type {} and of {} x {} of type {}; allowed are two of one size and CV_32FC1",
        log_before.cols, log_before.rows, log_before.type(), log_after.cols, log_after.rows, log_after.type());
  }
  if (!(largest_change > 0.0 && std::isfinite(largest_change))) {
    fail("largest change is {}; allowed is a finite number above 0", largest_change);
  }
  double largest = 0.0;
  for (int row = 0; row < log_before.rows; ++row) {
    const float* before = log_before.ptr<float>(row);
    const float* after = log_after.ptr<float>(row);
    for (int column = 0; column < log_before.cols; ++column) {
      const double change = std::abs(static_cast<double>(after[column]) - before[column]);
      if (!std::isfinite(change)) {
        fail("logarithms of pixel (column {}, row {}) are {} and {}; allowed are finite numbers", column, row,
             before[column], after[column]);
      }
      largest = std::max(largest, change);
    }
  }
  // n pictures between make n + 1 steps: largest / (n + 1) < largest_change.
  return static_cast<int>(std::min(std::floor(largest / largest_change), 0x1.0p30));
}

}  // namespace touchstone::render
