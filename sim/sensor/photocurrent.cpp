#include "sim/sensor/photocurrent.h"

#include <tbb/parallel_for.h>

#include "sim/scene/device_imager.h"

namespace touchstone::sim {
namespace {

/// The device's imager as a counter of electrons a second.
render::Imager electron_counter(const DeviceSpec& device, const SceneBands& bands) {
  render::Imager counter = imager(device, bands, false);
  counter.exposure_s = 1.0;
  return counter;
}

}  // namespace

Photocurrents::Photocurrents(const DeviceSpec& device, const SceneBands& bands)
    : imager_(electron_counter(device, bands)),
      per_irradiance_(render::response_of(imager_).electrons_per_irradiance) {}

double Photocurrents::of(int channel, const float* light) const {
  double current = 0.0;
  for (Eigen::Index band = 0; band < per_irradiance_.cols(); ++band)
    current += per_irradiance_(channel, band) * light[band];
  return current;
}

void Photocurrents::put(const cv::Mat& irradiance, cv::Mat& currents) const {
  const int bands = irradiance.channels();
  tbb::parallel_for(0, irradiance.rows, [&](int row) {
    const auto* light = irradiance.ptr<float>(row);
    auto* out = currents.ptr<float>(row);
    if (bands == 1 && per_irradiance_.rows() == 1) {
      const auto factor = static_cast<float>(per_irradiance_(0, 0));
      for (int column = 0; column < irradiance.cols; ++column) out[column] = factor * light[column];
      return;
    }
    for (int column = 0; column < irradiance.cols; ++column) {
      out[column] = static_cast<float>(at(column, row, light + column * bands));
    }
  });
}

cv::Mat Photocurrents::log_of(const cv::Mat& irradiance, const render::EventPixelSettings& pixels) const {
  cv::Mat currents(irradiance.size(), CV_32FC1);
  put(irradiance, currents);
  return render::log_intensity(currents, pixels);
}

}  // namespace touchstone::sim
