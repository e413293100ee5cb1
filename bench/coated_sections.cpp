#include "bench/coated_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "render/direct/direct_error.h"
#include "render/imager/imager.h"
#include "render/paths/trace_twice.h"
#include "sim/plan/plan.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/coated_view.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/scene_view.h"

namespace touchstone::bench {
namespace {

struct PressedObject {
  const char* name;
  double force_N;
};
constexpr PressedObject kPresses[] = {
    {"ball-8mm", 1.0}, {"coin-penny", 2.0}, {"fingerprint", 1.0}, {"usb-a-plug", 2.0}};

/// Each pixel of one column in `apart` and of one row in `apart`.
cv::Mat raster_of_pixels(const cv::Size& size, int apart) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8U);
  for (int row = apart / 2; row < size.height; row += apart) {
    for (int column = apart / 2; column < size.width; column += apart) mask.at<std::uint8_t>(row, column) = 255;
  }
  return mask;
}

struct Offness {
  double rms = 0.0, rms_error = 0.0, mean = 0.0;  // of the light's root mean square
  double noises = 0.0, noises_error = 0.0;        // root mean square, of the imager's noise in the pixel and channel
};

/// The root of a mean with its standard error, that of a root where it can't be distinguished from 0.
std::pair<double, double> root_of(const std::vector<double>& squares) {
  const auto count = static_cast<double>(squares.size());
  double mean = 0.0;
  for (const double square : squares) mean += square / count;
  double spread = 0.0;
  for (const double square : squares) spread += (square - mean) * (square - mean) / (count - 1.0) / count;
  const double error = std::sqrt(spread);
  return mean > error ? std::pair{std::sqrt(mean), 0.5 * error / std::sqrt(mean)}
                      : std::pair{std::sqrt(std::max(0.0, mean)), std::sqrt(error)};
}

/// As render::measure_direct_error: products of differences from two independent renderings, free of the paths' noise.
Offness offness_of(const cv::Mat& picture, const std::array<cv::Mat, 2>& traced, const cv::Mat& mask,
                   const render::Imager& imager) {
  const int bands = picture.channels();
  const render::ImagerResponse response = render::response_of(imager);
  std::vector<double> products, in_noises;
  double power = 0.0;
  double shift = 0.0;
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      if (mask.at<std::uint8_t>(row, column) == 0) continue;
      const Eigen::Index first = Eigen::Index{bands} * column;
      const auto at = [&](const cv::Mat& from) {
        return Eigen::Map<const Eigen::VectorXf>(from.ptr<float>(row) + first, bands).cast<double>().eval();
      };
      const Eigen::VectorXd a = at(traced[0]);
      const Eigen::VectorXd b = at(traced[1]);
      const Eigen::VectorXd one = at(picture);
      products.push_back((one - a).dot(one - b) / bands);
      shift += (one - 0.5 * (a + b)).sum() / bands;
      power += a.dot(b) / bands;
      double noises = 0.0;
      const Eigen::Index channels = response.electrons_per_irradiance.rows();
      for (Eigen::Index channel = 0; channel < channels; ++channel) {
        const auto per = response.electrons_per_irradiance.row(channel);
        const double noise = render::noise_e(response, per.dot(0.5 * (a + b)));
        noises += per.dot(one - a) * per.dot(one - b) / (noise * noise) / static_cast<double>(channels);
      }
      in_noises.push_back(noises);
    }
  }
  const auto count = static_cast<double>(products.size());
  const double whole = std::sqrt(power / count);
  Offness off;
  std::tie(off.rms, off.rms_error) = root_of(products);
  off.rms /= whole;
  off.rms_error /= whole;
  off.mean = shift / count / whole;
  std::tie(off.noises, off.noises_error) = root_of(in_noises);
  return off;
}

}  // namespace

ResultTable coated_error_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-coated";
  table.title = "Coated devices' pictures against path tracing";
  table.columns = {"device", "pressed by", "% RMS", "its mean, %", "in the imager's noises"};
  const int apart = options.quick ? 8 : 5;
  const int samples = options.quick ? 64 : 256;
  for (const char* name :
       {"gelsight-flat", "gelsight-markers", "gelsight-portable", "gelsight-dome", "gelsight-mini"}) {
    const std::string scenes = std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes";
    sim::DeviceSpec device = sim::read_device(scenes + "/devices/" + name + ".yaml");
    device.background = cv::Mat();  // the model's own light, not the real unit's
    device.residual = {};
    const sim::VirtualSensorSettings settings;
    const sim::VirtualSensor sensor(device, options.cache, settings);
    const render::Camera camera = sim::camera_of(*device.camera);
    for (const auto& [pressed, force_N] : kPresses) {
      const sim::ObjectSpec object = sim::read_object(scenes + "/objects/" + pressed + ".yaml");
      const sim::TouchObject seen = sensor.object(object);
      sim::PressSpec press;
      press.force_N = force_N;
      const sim::Touch touch = sensor.press(seen, press, {.picture = true, .truth = false});
      const sim::SceneSpec scene = sim::coated_scene(device, settings, object, {});
      const sim::SceneView view(scene, sim::make_plan(scene), sensor.gel());
      render::Scene all = view.seen(touch.press, view.relief(touch.press));
      all.interreflection = true;
      const cv::Mat mask = raster_of_pixels(touch.light.size(), apart);
      const auto traced = render::trace_twice(all, camera, mask, samples, render::RestLightSettings{}.max_depth, 7);
      const Offness off = offness_of(touch.light, traced, mask, sim::imager(device, view.plan.bands, true));
      table.rows.push_back({name, fmt::format("{}, {} N", pressed, force_N),
                            fmt::format("{:.2f} +- {:.2f}", 100 * off.rms, 100 * off.rms_error),
                            fmt::format("{:+.2f}", 100 * off.mean),
                            fmt::format("{:.2f} +- {:.2f}", off.noises, off.noises_error)});
    }
  }
  table.remarks = {
      fmt::format(
          "Each {}th pixel of each {}th row against path tracing with all bounces, {} samples twice, whose noise is "
          "not in the figures. \"Noises\": the difference in electrons of each channel over its own noise in time, "
          "root mean square.",
          apart, apart, samples),
      "Without a unit's own background and residual map, which path tracing doesn't know."};
  return table;
}

}  // namespace touchstone::bench
