#pragma once
// What event pixels make of light.

#include <opencv2/core/mat.hpp>

#include "render/events/event_pixels.h"
#include "render/imager/imager.h"
#include "sim/files/colour.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// Photocurrents of a device's pixels, electrons a second.
class Photocurrents {
 public:
  /// @pre the device has a camera
  Photocurrents(const DeviceSpec& device, const SceneBands& bands);

  int channels() const { return static_cast<int>(per_irradiance_.rows()); }
  /// Of the light of one pixel, W/m^2 a band, through one channel's filter.
  double of(int channel, const float* light) const;
  /// Of the pixel's own filter.
  double at(int column, int row, const float* light) const {
    return of(render::channel_of(imager_.bayer, column, row), light);
  }
  /// Of all pixels: `irradiance` is CV_32FC(bands), `currents` CV_32FC1 of its size.
  void put(const cv::Mat& irradiance, cv::Mat& currents) const;
  /// Their natural logarithms with the dark's current, CV_32FC1.
  cv::Mat log_of(const cv::Mat& irradiance, const render::EventPixelSettings& pixels) const;

 private:
  render::Imager imager_;
  render::QuantumEfficiency per_irradiance_;
};

}  // namespace touchstone::sim
