#include "sim/sensor/background_light.h"

#include <algorithm>

#include "core/error.h"
#include "sim/sensor/colour_numbers.h"

namespace touchstone::sim {

cv::Mat missing_at_rest(const cv::Mat& frame, const cv::Mat& rest_light, const render::Imager& imager) {
  TS_ASSERT(frame.type() == CV_8UC3 && frame.size() == rest_light.size());
  constexpr int kFullScale = 255;
  cv::Mat missing =
      linear_of_delivered(frame, imager.tone_curve) - linear_numbers(rest_light, numbers_per_irradiance(imager));
  for (int v = 0; v < frame.rows; ++v) {
    for (int u = 0; u < frame.cols; ++u) {
      for (int c = 0; c < 3; ++c) {
        if (frame.at<cv::Vec3b>(v, u)[2 - c] < kFullScale) continue;
        float& number = missing.at<cv::Vec3f>(v, u)[c];
        number = std::max(number, 0.0f);
      }
    }
  }
  return missing;
}

}  // namespace touchstone::sim
