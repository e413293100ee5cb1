#include "lab/fit/unit_fit_experiment.h"

#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "sim/press/gel_setup.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {
namespace {

constexpr double kWidest_mm = 0.5;
constexpr std::uint64_t kOtherLight = 1000;  // seeds of a fit's light are small numbers

/// A press of the validation's.
struct KnownPress {
  const char* ball;
  double x_mm, y_mm, depth_mm;
};
constexpr KnownPress kPresses[] = {{"ball-4mm", 0.0, 0.0, 0.4},   {"ball-8mm", 3.5, 2.5, 0.3},
                                   {"ball-4mm", -4.0, -2.5, 0.3}, {"ball-4.75mm", -2.5, 2.8, 0.5},
                                   {"ball-8mm", 2.0, -3.0, 0.5},  {"ball-4mm", 4.5, 0.0, 0.5}};
constexpr double kForceSd_N = 0.003;

}  // namespace

UnitFitSpec flat_gelsight_fit(const std::filesystem::path& scenes, int coarse_px) {
  UnitFitSpec spec;
  spec.name = "unit";
  spec.device = scenes / "devices" / "gelsight-flat.yaml";
  spec.coarse_px = coarse_px;
  for (const KnownPress& known : kPresses) {
    RecordedPress press;
    press.object = scenes / "objects" / (std::string(known.ball) + ".yaml");
    press.place_mm = {known.x_mm, known.y_mm};
    press.depth_mm = known.depth_mm;
    press.force_N = 1.0;  // record_unit reads it
    press.force_sd_N = kForceSd_N;
    spec.presses.push_back(press);
  }
  return spec;
}

void add_unknown(UnitFitSpec& spec, const std::string& path, UnknownHow how, double low, double high, bool together) {
  spec.unknowns.push_back({path, {path}, how, low, high, together, {}});
}

RecordedUnit record_unit(const PreparedFit& fit, const Eigen::VectorXd& hidden, int backgrounds, std::uint64_t seed,
                         const std::filesystem::path& cache_folder) {
  TS_ASSERT(backgrounds >= 0);
  RecordedUnit unit{fit, {}};
  const sim::DeviceSpec device = device_at(fit, hidden);
  sim::VirtualSensorSettings settings;
  settings.seed = kOtherLight + seed;
  settings.deepest_mm = fit.deepest_mm;
  settings.widest_mm = kWidest_mm;
  settings.membrane_um = fit.spec.membrane_um;
  settings.always_friction = true;
  sim::cache_gel_of_unit_modulus(device, cache_folder);
  const sim::VirtualSensor sensor(device, cache_folder, settings);
  const auto block = [&](const cv::Mat& picture, const std::string& name) {
    return block_picture(picture, name, *device.camera, fit.spec.coarse_px, fit.spec.where);
  };
  std::vector<BlockPicture> rest;
  for (int i = 0; i < backgrounds; ++i) rest.push_back(block(sensor.background(settings.seed, i), "rest"));
  if (!rest.empty()) unit.recording.background = mean_picture(rest);
  RandomStream random(seed, 0, Purpose::kTest);
  for (std::size_t i = 0; i < fit.spec.presses.size(); ++i) {
    RecordedPress& label = unit.fit.spec.presses[i];
    sim::PressSpec hold;
    hold.place_mm = label.place_mm;
    hold.angles_deg = label.angles_deg;
    hold.depth_mm = label.depth_mm.value();
    const sim::TouchObject object = sensor.object(fit.objects[i]);
    const fem::PressState press = sensor.play(object, sensor.motion_of(object, hold)).back().press;
    const sim::Touch touched = sensor.capture(object, press, settings.seed, backgrounds + static_cast<int>(i), false);
    unit.recording.presses.push_back(block(touched.frame, fmt::format("press {}", i)));
    if (label.force_N) label.force_N = press.wrench[2] + label.force_sd_N * random.normal();
    label.place_mm += label.place_sd_mm * normal_pair(random);
    label.depth_mm = *label.depth_mm + label.depth_sd_mm * random.normal();
  }
  return unit;
}

Eigen::VectorXd hidden_unknowns(const PreparedFit& fit, double part, std::uint64_t seed) {
  RandomStream random(seed, 1, Purpose::kTest);
  Eigen::VectorXd hidden(static_cast<Eigen::Index>(fit.unknowns.size()));
  for (std::size_t k = 0; k < fit.unknowns.size(); ++k) {
    const FitUnknown& unknown = fit.unknowns[k];
    const bool times = unknown.how == UnknownHow::times;
    const double low = times ? std::log(unknown.low) : unknown.low;
    const double high = times ? std::log(unknown.high) : unknown.high;
    hidden[static_cast<Eigen::Index>(k)] = 0.5 * (low + high) + part * (random.uniform() - 0.5) * (high - low);
  }
  return hidden;
}

double hidden_value(const PreparedFit& fit, const Eigen::VectorXd& hidden, std::size_t unknown) {
  const FitUnknown& of = fit.unknowns.at(unknown);
  return number_at(of, of.numbers.front().number, hidden[static_cast<Eigen::Index>(unknown)]);
}

}  // namespace touchstone::lab
