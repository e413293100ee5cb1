#include "lab/fit/unit_simulation.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "core/error.h"
#include "lab/fit/unit_pictures.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr std::size_t kSensorsKept = 2;  // of each lamp: where the fit stands, and a step beside it
constexpr double kWidest_mm = 0.5;
constexpr std::uint64_t kOtherLight = 500'000;  // beyond any number of lamps
constexpr std::size_t kMostKept = 256U << 20U;  // bytes of pictures of each lamp

/// What a press' state depends on: the scene's numbers, the press, its pose.
using Key = std::vector<double>;

Key with_pose(Key key, int press, const PressPose& pose) {
  key.insert(key.end(), {static_cast<double>(press), pose.place_mm.x(), pose.place_mm.y(), pose.depth_mm});
  return key;
}

struct PressedState {
  fem::PressState press;
  double force_N = 0.0, error_N = 0.0;
};

}  // namespace

struct UnitSimulation::Parts {
  Parts(const PreparedFit& of, std::filesystem::path cache_folder, Progress listener, std::uint64_t first_seed)
      : fit(of),
        cache(std::move(cache_folder)),
        progress(std::move(listener)),
        seed(first_seed),
        field_accuracy(of.spec.field_accuracy.front()) {
    by_lamp.resize(sources());
    lights.resize(sources());
    sim::cache_gel_of_unit_modulus(fit.device, cache);
  }

  /// The numbers that act on the scene and, with a lamp, on that lamp: under these its light is kept.
  Key key_of(const Eigen::VectorXd& x, int lamp) const {
    Key key;
    for (std::size_t k = 0; k < fit.unknowns.size(); ++k) {
      for (const FittedNumber& number : fit.unknowns[k].numbers) {
        const bool acts =
            number.acts == NumberActs::on_scene || (number.acts == NumberActs::on_lamp && number.lamp == lamp);
        if (acts) key.push_back(number_at(fit.unknowns[k], number.number, x[static_cast<Eigen::Index>(k)]));
      }
    }
    return key;
  }

  /// The lamps and, where there is light from it or may be, the room, whose number comes behind theirs.
  std::size_t sources() const {
    const bool room = fit.device.room_radiance.largest() > 0.0 ||
                      std::any_of(fit.unknowns.begin(), fit.unknowns.end(),
                                  [](const FitUnknown& unknown) { return unknown.path.starts_with("room_radiance"); });
    return fit.device.lamps.size() + (room ? 1 : 0);
  }

  /// The device with one lamp of 1 W in each band (or a room of 1 W/m^2/sr), the modulus that its file says, and blocks
  /// for pixels.
  sim::DeviceSpec device_of_lamp(const sim::DeviceSpec& whole, int lamp) const {
    sim::DeviceSpec device = with_block_camera(whole, fit.spec.coarse_px);
    const bool is_room = static_cast<std::size_t>(lamp) == whole.lamps.size();
    device.lamps = {is_room ? whole.lamps.front() : whole.lamps[static_cast<std::size_t>(lamp)]};
    device.lamps.front().power_W = is_room ? 0.0 : 1.0;
    device.room_radiance = is_room ? 1.0 : 0.0;
    device.gel.youngs_modulus_MPa = modulus_of(whole);
    return device;
  }

  /// The modulus that is simulated: where forces are in proportion to it that of the file.
  double modulus_of(const sim::DeviceSpec& whole) const {
    for (const FitUnknown& unknown : fit.unknowns) {
      for (const FittedNumber& number : unknown.numbers) {
        if (number.acts == NumberActs::on_force) return fit.device.gel.youngs_modulus_MPa;
      }
    }
    return whole.gel.youngs_modulus_MPa;
  }

  const sim::VirtualSensor& sensor(const sim::DeviceSpec& whole, const Key& key, int lamp) {
    auto& kept = by_lamp[static_cast<std::size_t>(lamp)];
    for (std::size_t i = 0; i < kept.size(); ++i) {
      if (kept[i].first != key) continue;
      std::rotate(kept.begin() + static_cast<std::ptrdiff_t>(i), kept.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                  kept.end());  // the newest last
      return *kept.back().second;
    }
    sim::VirtualSensorSettings settings;
    settings.seed = seed + static_cast<std::uint64_t>(lamp);  // lamps' light errs apart from each other
    settings.deepest_mm = fit.deepest_mm;
    settings.widest_mm = kWidest_mm;
    settings.membrane_um = fit.spec.membrane_um;
    settings.always_friction = true;
    // With light from the room the whole device has bounced light (sim/plan), so each of its lamps has.
    if (sources() > fit.device.lamps.size()) settings.interreflection_tolerance = 0.0;
    if (kept.size() == kSensorsKept) kept.erase(kept.begin());
    settings.field_accuracy = field_accuracy;
    if (progress) progress(stage, drawn, std::max(drawn + 1, expected));
    kept.emplace_back(key, std::make_unique<const sim::VirtualSensor>(device_of_lamp(whole, lamp), cache, settings));
    ++made;
    return *kept.back().second;
  }

  const PressedState& state(const sim::VirtualSensor& on, const Key& scene, int press, const PressPose& pose) {
    const Key key = with_pose(scene, press, pose);
    const auto known = states.find(key);
    if (known != states.end()) return known->second;
    const RecordedPress& recorded = fit.spec.presses[static_cast<std::size_t>(press)];
    sim::PressSpec hold;
    hold.place_mm = pose.place_mm;
    hold.angles_deg = recorded.angles_deg;
    hold.depth_mm = pose.depth_mm;
    return states.emplace(key, played(on, press, hold)).first->second;
  }

  PressedState played(const sim::VirtualSensor& on, int press, const sim::PressSpec& hold) const {
    const RecordedPress& recorded = fit.spec.presses[static_cast<std::size_t>(press)];
    try {
      const sim::TouchObject object = on.object(fit.objects[static_cast<std::size_t>(press)]);
      const sim::Truth truth = on.play(object, on.motion_of(object, hold)).back();
      return {truth.press, truth.press.wrench[2], truth.error.force.z()};
    } catch (const Error& error) {
      fail_at(recorded.where, "this press can't be simulated: {}", error.what());
    }
  }

  /// One lamp's light in a press' picture, W/m^2 for 1 W in each band; press -1: of the untouched gel.
  const cv::Mat& light(const sim::DeviceSpec& whole, const Eigen::VectorXd& x, int lamp, int press,
                       const PressPose& pose) {
    const Key scene = key_of(x, -1), own = key_of(x, lamp);
    auto& kept = lights[static_cast<std::size_t>(lamp)];
    const Key key = with_pose(own, press, pose);
    const auto known = kept.find(key);
    if (known != kept.end()) return known->second;
    if (kept.size() * bytes_of_picture(whole) > kMostKept) kept.clear();
    const sim::VirtualSensor& on = sensor(whole, own, lamp);
    cv::Mat drawing;
    if (press < 0) {
      drawing = on.background_light();
    } else {
      const PressedState& pressed = state(on, scene, press, pose);
      const sim::TouchObject object = on.object(fit.objects[static_cast<std::size_t>(press)]);
      drawing = on.capture(object, pressed.press, 1, 0, false).light;
    }
    ++drawn;
    if (progress) progress(stage, drawn, std::max(drawn, expected));
    return kept.emplace(key, drawing).first->second;
  }

  /// All lamps' light and the room's, at their power.
  cv::Mat whole_light(const sim::DeviceSpec& whole, const Eigen::VectorXd& x, int press, const PressPose& pose) {
    cv::Mat sum;
    for (std::size_t lamp = 0; lamp < sources(); ++lamp) {
      cv::Mat one;
      light(whole, x, static_cast<int>(lamp), press, pose).convertTo(one, CV_64F);
      const int bands = one.channels();
      const render::Spectrum power = lamp < whole.lamps.size()
                                         ? sim::in_bands(whole.lamps[lamp].power_W, bands_of(whole), "power_W")
                                         : sim::in_bands(whole.room_radiance, bands_of(whole), "room_radiance");
      for (int v = 0; v < one.rows; ++v) {
        double* at = one.ptr<double>(v);
        for (int i = 0; i < bands * one.cols; ++i) at[i] *= power[i % bands];
      }
      sum = sum.empty() ? one : cv::Mat(sum + one);
    }
    return sum;
  }

  /// One press alone.
  SimulatedUnit shown(const sim::DeviceSpec& whole, const render::Imager& imager, const Eigen::VectorXd& x, int press,
                      const PressPose& pose) {
    SimulatedUnit one;
    one.presses = {mean_numbers(whole_light(whole, x, press, pose), imager)};
    const Key scene = key_of(x, -1);
    auto known = states.find(with_pose(scene, press, pose));
    if (known == states.end()) {
      state(sensor(whole, key_of(x, 0), 0), scene, press, pose);
      known = states.find(with_pose(scene, press, pose));
    }
    const double share = whole.gel.youngs_modulus_MPa / modulus_of(whole);
    one.force_N = Eigen::VectorXd::Constant(1, share * known->second.force_N);
    one.force_error_N = Eigen::VectorXd::Constant(1, share * known->second.error_N);
    return one;
  }

  static render::Imager imager_of(const sim::DeviceSpec& whole) { return sim::imager(whole, bands_of(whole), true); }

  std::size_t bytes_of_picture(const sim::DeviceSpec& whole) const {
    const auto pixels = static_cast<std::size_t>(whole.camera->width) * static_cast<std::size_t>(whole.camera->height);
    const auto block = static_cast<std::size_t>(fit.spec.coarse_px);
    return sizeof(float) * whole.band_wavelengths_nm.size() * pixels / (block * block);
  }

  static sim::SceneBands bands_of(const sim::DeviceSpec& device) {
    const auto& list = device.band_wavelengths_nm;
    return {Eigen::Map<const Eigen::ArrayXd>(list.data(), static_cast<Eigen::Index>(list.size())), std::nullopt};
  }

  const PreparedFit& fit;
  std::filesystem::path cache;
  Progress progress;
  std::uint64_t seed;
  double field_accuracy;
  int made = 0;
  std::string stage;
  std::int64_t drawn = 0, expected = 0;                                                         // of the stage
  std::vector<std::vector<std::pair<Key, std::unique_ptr<const sim::VirtualSensor>>>> by_lamp;  // by lamp
  std::vector<std::map<Key, cv::Mat>> lights;                                                   // by lamp
  std::map<Key, PressedState> states;
};

UnitSimulation::UnitSimulation(const PreparedFit& fit, const std::filesystem::path& cache_folder, Progress progress)
    : parts_(std::make_unique<Parts>(fit, cache_folder, std::move(progress), fit.spec.seed)) {}
UnitSimulation::UnitSimulation(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
UnitSimulation::~UnitSimulation() = default;

SimulatedUnit UnitSimulation::show_press(const Eigen::VectorXd& x, int press, const PressPose& pose) {
  const sim::DeviceSpec whole = device_at(parts_->fit, x);
  return parts_->shown(whole, Parts::imager_of(whole), x, press, pose);
}

SimulatedUnit UnitSimulation::show(const Eigen::VectorXd& x, const std::vector<PressPose>& poses) {
  const sim::DeviceSpec whole = device_at(parts_->fit, x);
  const render::Imager imager = Parts::imager_of(whole);
  TS_ASSERT(poses.size() == parts_->fit.spec.presses.size());
  SimulatedUnit shown;
  shown.background = mean_numbers(parts_->whole_light(whole, x, -1, {}), imager);
  shown.force_N.resize(static_cast<Eigen::Index>(poses.size()));
  shown.force_error_N.resize(static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const SimulatedUnit one = parts_->shown(whole, imager, x, static_cast<int>(i), poses[i]);
    shown.presses.push_back(one.presses.front());
    shown.force_N[static_cast<Eigen::Index>(i)] = one.force_N[0];
    shown.force_error_N[static_cast<Eigen::Index>(i)] = one.force_error_N[0];
  }
  return shown;
}

SimulatedUnit UnitSimulation::show_other_light(const Eigen::VectorXd& x, const std::vector<PressPose>& poses) {
  if (!other_) {
    other_.reset(new UnitSimulation(
        std::make_unique<Parts>(parts_->fit, parts_->cache, parts_->progress, parts_->seed + kOtherLight)));
  }
  other_->set_field_accuracy(parts_->field_accuracy);
  other_->expect(parts_->stage, parts_->expected);
  return other_->show(x, poses);
}

double UnitSimulation::depth_of_force(const Eigen::VectorXd& x, int press, const PressPose& pose, double force_N) {
  const sim::DeviceSpec whole = device_at(parts_->fit, x);
  const sim::VirtualSensor& on = parts_->sensor(whole, parts_->key_of(x, 0), 0);
  sim::PressSpec hold;
  hold.place_mm = pose.place_mm;
  hold.angles_deg = parts_->fit.spec.presses[static_cast<std::size_t>(press)].angles_deg;
  hold.force_N = force_N * parts_->modulus_of(whole) / whole.gel.youngs_modulus_MPa;
  const sim::TouchObject object = on.object(parts_->fit.objects[static_cast<std::size_t>(press)]);
  const double touch = sim::first_touch(hold, object.spec(), on.device().gel);
  return touch - parts_->played(on, press, hold).press.gel_from_object.translation.z();
}

render::Imager UnitSimulation::imager(const Eigen::VectorXd& x) const {
  return Parts::imager_of(device_at(parts_->fit, x));
}

void UnitSimulation::set_field_accuracy(double accuracy) {
  if (accuracy == parts_->field_accuracy) return;
  parts_->field_accuracy = accuracy;
  for (auto& kept : parts_->by_lamp) kept.clear();
  for (auto& kept : parts_->lights) kept.clear();
}

void UnitSimulation::expect(const std::string& stage, std::int64_t pictures) {
  parts_->stage = stage;
  parts_->drawn = 0;
  parts_->expected = pictures;
}

int UnitSimulation::sources() const {
  return static_cast<int>(parts_->sources());
}

int UnitSimulation::lamp_setups() const {
  return parts_->made + (other_ ? other_->lamp_setups() : 0);
}

}  // namespace touchstone::lab
