#include "sensors/markers/motion_ratio.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

void check(const cv::Mat& image, const cv::Mat& background, const char* name) {
  if (image.empty() || (image.type() != CV_8UC3 && image.type() != CV_8UC1))
    fail("motion ratio: the {} picture isn't BGR or grey of 8 bit", name);
  if (image.type() != background.type())
    fail("motion ratio: the {} picture has other channels than the background", name);
  if (image.size() != background.size()) {
    fail("motion ratio: the {} picture is {} x {} px, the background {} x {}", name, image.cols, image.rows,
         background.cols, background.rows);
  }
}

/// The least sum of grey levels that is above a threshold.
int levels_above(double threshold, const char* name) {
  if (!(threshold >= 0.0 && threshold <= 3.0)) fail("{} is {}, it must be from 0 to 3", name, threshold);
  return static_cast<int>(std::floor(255.0 * threshold)) + 1;
}

template <int channels>
int difference(const std::uint8_t* a, const std::uint8_t* b) {
  if constexpr (channels == 1) return 3 * std::abs(a[0] - b[0]);
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

template <int channels>
void count_pixels(const cv::Mat& background, const cv::Mat& earlier, const cv::Mat& later, int contact_levels,
                  int motion_levels, cv::Mat* contact, MotionRatio& result) {
  for (int y = 0; y < background.rows; ++y) {
    const std::uint8_t* rest = background.ptr<std::uint8_t>(y);
    const std::uint8_t* before = earlier.ptr<std::uint8_t>(y);
    const std::uint8_t* now = later.ptr<std::uint8_t>(y);
    std::uint8_t* mask = contact != nullptr ? contact->ptr<std::uint8_t>(y) : nullptr;
    for (int x = 0; x < background.cols; ++x, rest += channels, before += channels, now += channels) {
      result.contact_px += difference<channels>(before, rest) >= contact_levels ? 1 : 0;
      result.motion_px += difference<channels>(now, before) >= motion_levels ? 1 : 0;
      if (mask != nullptr) mask[x] = difference<channels>(now, rest) >= contact_levels ? 255 : 0;
    }
  }
}

}  // namespace

MotionRatio motion_ratio(const cv::Mat& background, const cv::Mat& earlier, const cv::Mat& later,
                         const MotionRatioSettings& settings, cv::Mat* contact) {
  check(background, background, "background");
  check(earlier, background, "earlier");
  check(later, background, "later");
  const int contact_levels = levels_above(settings.contact_threshold, "contact_threshold");
  const int motion_levels = levels_above(settings.motion_threshold, "motion_threshold");
  if (contact != nullptr) contact->create(background.size(), CV_8UC1);
  MotionRatio result;
  const auto count = background.channels() == 1 ? count_pixels<1> : count_pixels<3>;
  count(background, earlier, later, contact_levels, motion_levels, contact, result);
  if (result.contact_px >= settings.least_contact_px && result.contact_px > 0) {
    result.ratio = static_cast<double>(result.motion_px) / result.contact_px;
  }
  return result;
}

}  // namespace touchstone::sensors
