#include "render/rolling_shutter.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::render {

std::vector<double> exposure_shares(const std::vector<double>& times_s, double from_s, double to_s) {
  if (times_s.empty()) fail("exposure: there is no instant to take light from");
  for (std::size_t i = 1; i < times_s.size(); ++i) {
    if (!(times_s[i] > times_s[i - 1])) {
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

cv::Mat rolling_exposure(const std::vector<TimedIrradiance>& instants, const ShutterTiming& timing) {
  if (instants.empty()) fail("exposure: there is no instant to take light from");
  if (!(timing.exposure_s >= 0.0) || !std::isfinite(timing.exposure_s) || !std::isfinite(timing.start_s) ||
      !std::isfinite(timing.line_time_s)) {
    fail("exposure: start {} s, exposure {} s, line time {} s; all must be finite, the exposure 0 or more",
         timing.start_s, timing.exposure_s, timing.line_time_s);
  }
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
  cv::Mat out(first.size(), first.type());
  const int numbers = first.cols * first.channels();
  std::vector<double> sum(static_cast<std::size_t>(numbers));
  for (int row = 0; row < first.rows; ++row) {
    const double from = timing.start_s + row * timing.line_time_s;
    const std::vector<double> shares = exposure_shares(times, from, from + timing.exposure_s);
    std::fill(sum.begin(), sum.end(), 0.0);
    for (std::size_t k = 0; k < instants.size(); ++k) {
      if (shares[k] == 0.0) continue;
      const auto* light = instants[k].irradiance.ptr<float>(row);
      for (int i = 0; i < numbers; ++i) sum[i] += shares[k] * light[i];
    }
    auto* mean = out.ptr<float>(row);
    for (int i = 0; i < numbers; ++i) mean[i] = static_cast<float>(sum[i]);
  }
  return out;
}

}  // namespace touchstone::render
