#include "render/cameras/rolling_shutter.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::render {

std::vector<double> exposure_shares(const std::vector<double>& times_s, double from_s, double to_s) {
  if (times_s.empty()) fail("exposure: there is no instant to take light from");
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    if (!std::isfinite(times_s[i])) fail("exposure: instant {} is at {} s; it must be finite", i, times_s[i]);
    if (i > 0 && !(times_s[i] > times_s[i - 1])) {
      fail("exposure: instant {} is at {} s, after one at {} s; times must grow", i, times_s[i], times_s[i - 1]);
    }
  }
  const double slack = 1e-9 * (times_s.back() - times_s.front());  // sums of line times are rounded
  if (!(from_s <= to_s) || !(from_s >= times_s.front() - slack) || !(to_s <= times_s.back() + slack)) {
    fail("exposure: from {} s to {} s isn't within the instants, {} s to {} s", from_s, to_s, times_s.front(),
         times_s.back());
  }
  from_s = std::clamp(from_s, times_s.front(), times_s.back());
  to_s = std::clamp(to_s, times_s.front(), times_s.back());
  std::vector<double> shares(times_s.size(), 0.0);
  if (times_s.size() == 1) {
    shares[0] = 1.0;
    return shares;
  }
  for (std::size_t i = 0; i + 1 < times_s.size(); ++i) {
    const double span = times_s[i + 1] - times_s[i];
    const double low = std::max(from_s, times_s[i]);
    const double high = std::min(to_s, times_s[i + 1]);
    if (low > high) continue;
    // Over [low, high] the later instant's weight is that at the middle.
    const double later = (0.5 * (low + high) - times_s[i]) / span;
    if (to_s > from_s) {
      const double part = (high - low) / (to_s - from_s);
      shares[i] += part * (1.0 - later);
      shares[i + 1] += part * later;
    } else {
      shares[i] = 1.0 - later;
      shares[i + 1] = later;
      break;
    }
  }
  return shares;
}

RollingExposure::RollingExposure(const std::vector<double>& times_s, const ShutterTiming& timing, cv::Size size,
                                 int bands)
    : sum_(size, CV_64FC(bands), cv::Scalar::all(0.0)), variance_(size, CV_64FC1, cv::Scalar(0.0)) {
  if (!(timing.exposure_s >= 0.0) || !std::isfinite(timing.exposure_s) || !std::isfinite(timing.start_s) ||
      !std::isfinite(timing.line_time_s)) {
    fail("exposure: start {} s, exposure {} s, line time {} s; all must be finite, the exposure 0 or more",
         timing.start_s, timing.exposure_s, timing.line_time_s);
  }
  for (int row = 0; row < size.height; ++row) {
    const double from = timing.start_s + row * timing.line_time_s;
    shares_.push_back(exposure_shares(times_s, from, from + timing.exposure_s));
  }
}

void RollingExposure::add(std::size_t instant, const cv::Mat& irradiance, const cv::Mat& standard_error) {
  TS_ASSERT(irradiance.size() == sum_.size() && irradiance.type() == CV_32FC(sum_.channels()));
  TS_ASSERT(standard_error.empty() || (standard_error.size() == sum_.size() && standard_error.type() == CV_32FC1));
  const int numbers = sum_.cols * sum_.channels();
  for (int row = 0; row < sum_.rows; ++row) {
    const double share = shares_[static_cast<std::size_t>(row)].at(instant);
    if (share == 0.0) continue;
    const auto* light = irradiance.ptr<float>(row);
    auto* sum = sum_.ptr<double>(row);
    for (int i = 0; i < numbers; ++i) sum[i] += share * light[i];
    if (standard_error.empty()) continue;
    const auto* error = standard_error.ptr<float>(row);
    auto* variance = variance_.ptr<double>(row);
    for (int i = 0; i < sum_.cols; ++i) variance[i] += share * share * error[i] * error[i];
  }
}

cv::Mat RollingExposure::irradiance() const {
  cv::Mat mean;
  sum_.convertTo(mean, CV_32F);
  return mean;
}

cv::Mat RollingExposure::standard_error() const {
  cv::Mat error;
  cv::sqrt(variance_, error);
  error.convertTo(error, CV_32F);
  return error;
}

cv::Mat rolling_exposure(const std::vector<TimedIrradiance>& instants, const ShutterTiming& timing) {
  if (instants.empty()) fail("exposure: there is no instant to take light from");
  const cv::Mat& first = instants.front().irradiance;
  if (first.empty() || first.depth() != CV_32F || first.dims != 2) {
    fail("exposure: irradiance must be pictures of 32 bit floats that aren't empty");
  }
  std::vector<double> times;
  for (const TimedIrradiance& instant : instants) {
    if (instant.irradiance.size() != first.size() || instant.irradiance.type() != first.type()) {
      fail("exposure: the picture at {} s differs in size or type from the first one's", instant.time_s);
    }
    times.push_back(instant.time_s);
  }
  RollingExposure exposure(times, timing, first.size(), first.channels());
  for (std::size_t k = 0; k < instants.size(); ++k) exposure.add(k, instants[k].irradiance);
  return exposure.irradiance();
}

}  // namespace touchstone::render
