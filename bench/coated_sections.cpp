#include "bench/coated_sections.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/stopwatch.h"
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

constexpr const char* kDevices[] = {"gelsight-flat", "gelsight-markers", "gelsight-portable", "gelsight-dome",
                                    "gelsight-mini"};

/// "devices/gelsight-flat" among the shipped files.
std::string shipped(const std::string& name) {
  return std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/" + name + ".yaml";
}

/// Each pixel of one column in `apart` and of one row in `apart`.
cv::Mat raster_of_pixels(const cv::Size& size, int apart) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8U);
  for (int row = apart / 2; row < size.height; row += apart) {
    for (int column = apart / 2; column < size.width; column += apart) mask.at<std::uint8_t>(row, column) = 255;
  }
  return mask;
}

/// What changes from press to press, so that nothing is remembered: part of the force.
constexpr double kForceStep = 0.02;

/// Seconds of one thread for the parts of a labelled picture, and on the clock with all.
struct PictureTimes {
  double press = 0.0, contact = 0.0, light = 0.0, imager = 0.0, truth = 0.0;
  double clock = 0.0, clock_all = 0.0;
};

PictureTimes times_of(const sim::VirtualSensor& sensor, const sim::VirtualSensorSettings& settings,
                      const sim::ObjectSpec& object, double force_N, int repeats) {
  const sim::TouchObject seen = sensor.object(object);
  const sim::SceneSpec scene = sim::coated_scene(sensor.device(), settings, object, {});
  const sim::SceneView view(scene, sim::make_plan(scene), sensor.gel());
  const auto press_of = [&](int k) {
    sim::PressSpec press;
    press.force_N = force_N * (1.0 + kForceStep * k);
    return press;
  };
  sensor.press(seen, press_of(0));  // what all touches share is made here
  const auto mean_of = [&](const auto& watch, const auto& work) {
    for (int k = 1; k <= repeats; ++k) work(k);
    return watch.seconds() / repeats;
  };
  const auto press = [&](int k) { sensor.press(seen, press_of(k)); };
  PictureTimes times;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    std::vector<fem::PressState> states(static_cast<std::size_t>(repeats) + 1);
    times.press = mean_of(ProcessorStopwatch(), [&](int k) {
      states[static_cast<std::size_t>(k)] = sensor.play(seen, sensor.motion_of(seen, press_of(k))).back().press;
    });
    const auto state = [&](int k) -> const fem::PressState& { return states[static_cast<std::size_t>(k)]; };
    times.contact = mean_of(ProcessorStopwatch(), [&](int k) { view.relief(state(k)); });
    const double frame = mean_of(ProcessorStopwatch(), [&](int k) { sensor.capture(seen, state(k), 1, k, false); });
    const double all = mean_of(ProcessorStopwatch(), [&](int k) { sensor.capture(seen, state(k), 1, k, true); });
    const sim::Touch touch = sensor.press(seen, press_of(1));
    times.imager = mean_of(ProcessorStopwatch(), [&](int k) { touch.expose(static_cast<std::uint64_t>(k)); });
    times.light = frame - times.contact - times.imager;
    times.truth = all - frame;
    times.clock = mean_of(Stopwatch(), press);
  }
  times.clock_all = mean_of(Stopwatch(), press);
  return times;
}

struct Offness {
  render::DirectError light;
  double noises = 0.0, noises_error = 0.0;  // root mean square, of the imager's noise in the pixel and channel
};

Offness offness_of(const cv::Mat& picture, const std::array<cv::Mat, 2>& traced, const cv::Mat& mask,
                   const render::Imager& imager) {
  const int bands = picture.channels();
  const render::ImagerResponse response = render::response_of(imager);
  const auto channels = static_cast<int>(response.electrons_per_irradiance.rows());
  // Electrons over their noise, for each channel; 0 beside the mask.
  std::array<cv::Mat, 3> in_noises;
  for (cv::Mat& one : in_noises) one = cv::Mat::zeros(picture.size(), CV_32FC(channels));
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      if (mask.at<std::uint8_t>(row, column) == 0) continue;
      const auto electrons = [&](const cv::Mat& from) -> Eigen::VectorXd {
        const float* const first = from.ptr<float>(row) + std::ptrdiff_t{bands} * column;
        return response.electrons_per_irradiance * Eigen::Map<const Eigen::VectorXf>(first, bands).cast<double>();
      };
      const std::array<Eigen::VectorXd, 3> seen = {electrons(traced[0]), electrons(traced[1]), electrons(picture)};
      for (int channel = 0; channel < channels; ++channel) {
        const double noise = render::noise_e(response, 0.5 * (seen[0][channel] + seen[1][channel]));
        for (std::size_t k = 0; k < seen.size(); ++k) {
          in_noises[k].ptr<float>(row)[channels * column + channel] = static_cast<float>(seen[k][channel] / noise);
        }
      }
    }
  }
  const render::DirectError noises = render::direct_error_beside({in_noises[0], in_noises[1]}, in_noises[2], mask);
  const double signal = std::sqrt(in_noises[0].dot(in_noises[1]) / (double(noises.pixels) * channels));
  return {render::direct_error_beside(traced, picture, mask), signal * noises.rms, signal * noises.rms_error};
}

}  // namespace

ResultTable coated_error_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-coated";
  table.title = "Coated devices' pictures against path tracing";
  table.columns = {"device", "pressed by", "% RMS", "its mean, %", "in the imager's noises"};
  const int apart = options.quick ? 8 : 5;
  const int samples = options.quick ? 64 : 256;
  for (const std::string name : kDevices) {
    sim::DeviceSpec device = sim::read_device(shipped("devices/" + name));
    device.background = cv::Mat();  // the model's own light, not the real unit's
    device.residual = {};
    const sim::VirtualSensorSettings settings;
    const sim::VirtualSensor sensor(device, options.cache, settings);
    const render::Camera camera = sim::camera_of(*device.camera);
    for (const auto& [pressed, force_N] : kPresses) {
      const sim::ObjectSpec object = sim::read_object(shipped(std::string("objects/") + pressed));
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
                            fmt::format("{:.2f} +- {:.2f}", 100 * off.light.rms, 100 * off.light.rms_error),
                            fmt::format("{:+.2f}", 100 * off.light.mean),
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

ResultTable coated_time_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-coated-time";
  const int repeats = options.quick ? 3 : 10;
  table.title = "What a labelled picture of a coated device takes";
  table.columns = {"device",     "pressed by", "press, ms", "contact, ms", "light, ms",
                   "imager, ms", "truth, ms",  "sum, ms",   "clock, ms",   "clock on all threads, ms"};
  for (const std::string name : kDevices) {
    const sim::VirtualSensorSettings settings;
    const sim::VirtualSensor sensor(sim::read_device(shipped("devices/" + name)), options.cache, settings);
    for (const auto& [pressed, force_N] : kPresses) {
      const sim::ObjectSpec object = sim::read_object(shipped(std::string("objects/") + pressed));
      const PictureTimes times = times_of(sensor, settings, object, force_N, repeats);
      const double sum = times.press + times.contact + times.light + times.imager + times.truth;
      std::vector<std::string> row = {name, fmt::format("{}, {} N", pressed, force_N)};
      for (const double seconds :
           {times.press, times.contact, times.light, times.imager, times.truth, sum, times.clock, times.clock_all}) {
        row.push_back(fmt::format("{:.1f}", 1e3 * seconds));
      }
      table.rows.push_back(std::move(row));
    }
  }
  table.remarks = {fmt::format(
      "Processor time of one thread, the mean of {} presses whose forces differ by {} %. Contact: the fine contact "
      "under the coarse press. Truth: heights and contact of each pixel. The last two columns are the clock's, on one "
      "thread and on all {}.",
      repeats, 100 * kForceStep, tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))};
  return table;
}

}  // namespace touchstone::bench
