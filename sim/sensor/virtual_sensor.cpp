#include "sim/sensor/virtual_sensor.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/error.h"
#include "core/locked_work.h"
#include "core/units.h"
#include "render/imager/imager.h"
#include "sim/plan/size_doubt.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/clear_view.h"
#include "sim/sensor/coated_view.h"
#include "sim/sensor/colour_numbers.h"
#include "sim/sensor/milky_view.h"
#include "sim/sensor/press_events.h"
#include "sim/sensor/residual_light.h"
#include "sim/view/marker_motion.h"

namespace touchstone::sim {
namespace {

constexpr std::uint64_t kOtherNoise = 0x5bd1e995;  // of a touch's background
constexpr double kFrameRate_Hz = 30.0;             // of a press on a device without a camera
constexpr int kEventSteps = 12;                    // of a press that event pixels watch, at least, down and aside

/// What light needs and mechanics doesn't.
struct Optics {
  std::unique_ptr<const SensorView> view;
  render::Imager imager;  // for light of the untouched device's bands
  render::FixedPattern pattern;
  cv::Mat rest_light;
  render::ControlState rest_control;
};

/// As a camera has set itself that has watched this light for long.
render::ControlState settled_on(const cv::Mat& light, const render::Imager& imager) {
  if (!render::is_automatic(imager)) return {};
  return render::settled(imager, render::metering_of(light, imager));
}

/// As it has set itself `seconds` after `before` turned into `light`.
render::ControlState after_change(const cv::Mat& before, const cv::Mat& light, const render::Imager& imager,
                                  double seconds, double frame_rate_Hz) {
  render::ControlState state = settled_on(before, imager);
  if (!render::is_automatic(imager) || !(seconds > 0.0)) return state;
  constexpr double kMostSteps = 1000.0;  // shorter ones matter to a picture alone that clips
  const double steps = std::clamp(std::round(seconds * frame_rate_Hz), 1.0, kMostSteps);
  const render::Metering metering = render::metering_of(light, imager);
  for (int step = 0; step < static_cast<int>(steps); ++step) {
    state = render::next_state(imager, state, metering, seconds / steps);
  }
  return state;
}

/// From the last state without contact to the end.
double seconds_of_contact(std::span<const Truth> states) {
  const auto touched =
      std::find_if(states.begin(), states.end(), [](const Truth& truth) { return truth.press.contact_vertices > 0; });
  if (touched == states.end()) return 0.0;
  const auto before = touched == states.begin() ? touched : touched - 1;
  return static_cast<double>(states.back().t_us - before->t_us) / kMicrosecondsPerSecond;
}

/// What is pressed, without pictures.
SceneSpec unseen_scene(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object,
                       const MotionSpec& motion) {
  SceneSpec scene;
  scene.device = device;
  scene.object = object;
  scene.motion = motion;
  scene.seed = settings.seed;
  scene.outputs = {};
  scene.outputs.frames = false;
  scene.effects = effects_of(device, settings, object);
  return scene;
}

/// Electrons a second in each pixel of a grey sensor.
cv::Mat photocurrent(const cv::Mat& light, const render::ImagerResponse& response) {
  const int bands = light.channels();
  cv::Mat weights(1, bands, CV_32FC1);
  for (int b = 0; b < bands; ++b) weights.at<float>(b) = static_cast<float>(response.electrons_per_irradiance(0, b));
  cv::Mat current;
  cv::transform(light, current, weights);
  return current;
}

}  // namespace

struct VirtualSensor::Parts {
  Parts(DeviceSpec device_of, const std::filesystem::path& cache, const VirtualSensorSettings& settings_of,
        const Progress& progress)
      : device(std::move(device_of)),
        cache_folder(cache),
        settings(settings_of),
        gel(set_up_gel(device, cache, progress)),
        markers(marker_places(device, *gel)) {}

  const Optics& optics() const {
    locked_work(making, [this] {
      if (made) return;
      if (!device.camera) fail("device {}: has no camera, so it can't be looked through", device.name);
      auto now = std::make_unique<Optics>();
      now->view = device.coating     ? coated_view(device, *gel, cache_folder, settings)
                  : is_milky(device) ? milky_view(device, *gel, settings)
                                     : clear_view(device, *gel, settings);
      const Plan& plan = now->view->plan();
      now->imager = sim::imager(device, bands_of(plan.bands), with_noise(plan));
      now->pattern = render::fixed_pattern(now->imager, {device.camera->width, device.camera->height}, settings.seed);
      now->rest_light = now->view->rest_light(nullptr, Eigen::Vector3d::Zero());
      now->rest_control = settled_on(now->rest_light, now->imager);
      made = std::move(now);
    });
    return *made;
  }

  /// Maps of a milky gel ask the plan for no picture, which then says nothing of its bands and noise.
  SceneBands bands_of(const SceneBands& planned) const {
    if (planned.count() > 0) return planned;
    SceneBands bands;
    bands.centres_nm = Eigen::Map<const Eigen::ArrayXd>(device.band_wavelengths_nm.data(),
                                                        static_cast<Eigen::Index>(device.band_wavelengths_nm.size()));
    return bands;
  }
  bool with_noise(const Plan& plan) const { return plan.bands.count() == 0 || plan.sensor_noise; }

  SceneSpec mechanics_of(const ObjectSpec& object, const MotionSpec& motion) const {
    return unseen_scene(device, settings, object, motion);
  }

  std::vector<Truth> play(const SeenObject& object, const MotionSpec& motion) const {
    const SceneSpec scene = mechanics_of(object.spec, motion);
    const Plan plan = make_plan(scene);
    return play_motion(scene, plan, *gel, {}, nullptr, set_up_elastic_objects(scene, plan, cache_folder),
                       {object.shape});
  }

  /// `imager`: as controlled().
  cv::Mat develop(const cv::Mat& irradiance, const render::Imager& imager, std::uint64_t noise_seed, int frame) const {
    return render::develop(
        render::expose(irradiance, imager, optics().pattern, noise_seed, static_cast<std::uint64_t>(frame)), imager);
  }
  SceneBands bands_of(const SeenObject& object) const { return bands_of(optics().view->bands(object)); }
  render::Imager imager_of(const SeenObject& object) const {
    return sim::imager(device, bands_of(object), with_noise(optics().view->plan()));
  }

  bool has_events() const { return device.camera && device.camera->events; }
  bool has_chip() const { return device.camera && device.camera->motion_chip; }

  MotionSpec motion_of(const SeenObject& object, const PressSpec& press) const {
    check(press);
    const double touch = touch_of(object, press);
    const double rate = device.camera ? device.camera->frame_rate_Hz : kFrameRate_Hz;
    MotionSpec motion = press_motion(press, touch, object.spec.friction, rate);
    if (has_events()) {
      int most = kEventSteps;
      for (const MotionKey& key : motion.keys) most = std::max(most, key.frames);
      for (MotionKey& key : motion.keys) key.frames = most;
      if (press.seconds) motion.frame_rate_Hz = most / *press.seconds;
    }
    return motion;
  }

  /// A height may also be one where the object isn't over the gel: then it's led straight there.
  double touch_of(const SeenObject& object, const PressSpec& press) const {
    if (!press.height_mm) return first_touch(press, object.detailed, device.gel);
    try {
      return first_touch(press, object.detailed, device.gel);
    } catch (const Error&) {
      return *press.height_mm;
    }
  }

  /// What the camera delivers at the end of `states`, the first of which is out of contact.
  void show(const SeenObject& object, const std::vector<Truth>& states, const TouchOptions& options,
            Touch& touch) const {
    const Optics& by = optics();
    const Eigen::Vector3d start = states.front().press.gel_from_object.translation;
    SeenTouch seen = by.view->see(object, states.back().press, start, options.truth);
    touch.light = seen.light;
    touch.height = seen.height;
    touch.contact = seen.contact;
    const cv::Mat rest = object.spec.screen ? by.view->rest_light(&object, start) : rest_of(object, start);
    const render::Imager fixed = imager_of(object);
    touch.control = after_change(rest, touch.light, fixed, seconds_of_contact(states), device.camera->frame_rate_Hz);
    const render::Imager imager = render::controlled(fixed, touch.control);
    touch.expose = [this, light = touch.light, imager](std::uint64_t seed) { return develop(light, imager, seed, 0); };
    touch.frame = develop(touch.light, imager, options.noise_seed, options.frame);
    touch.background = develop(rest, render::controlled(fixed, settled_on(rest, fixed)),
                               options.noise_seed ^ kOtherNoise, options.frame);
    if (has_chip()) {
      std::vector<cv::Mat> lights;
      for (std::size_t k = 1; k + 1 < states.size(); ++k) {
        lights.push_back(by.view->see(object, states[k].press, start, false).light);
      }
      lights.push_back(touch.light);
      const render::MotionChipSettings chip = motion_chip(device, bands_of(object), with_noise(by.view->plan()));
      const ChipTouch shown = chip_touch(chip, rest, lights, settings.seed, options.noise_seed);
      touch.frame = shown.raw;
      touch.statistics = shown.statistics;
      touch.background = chip_touch(chip, rest, {}, settings.seed, options.noise_seed ^ kOtherNoise).raw;
      touch.expose = [this, chip, rest, lights](std::uint64_t seed) {
        return chip_touch(chip, rest, lights, settings.seed, seed).raw;
      };
    }
    if (has_events()) {
      render::Imager counter = sim::imager(device, bands_of(object), false);
      counter.exposure_s = 1.0;
      const render::ImagerResponse response = render::response_of(counter);
      const render::EventPixelSettings& pixels = device.camera->events->pixels;
      if (std::optional<LightOfKeys> keys = by.view->light_of_keys(object)) {
        keys->currents = [&](const cv::Mat& light, cv::Mat& currents) { currents = photocurrent(light, response); };
        touch.events = events_of_press(states, *keys, *gel, pixels, settings.seed, options.noise_seed);
      } else {
        const auto light = [&](const fem::PressState& press) {
          return photocurrent(by.view->see(object, press, start, false).light, response);
        };
        touch.events = events_of_press(states, light, pixels, settings.seed, options.noise_seed);
      }
    }
  }

  /// The background of a touch: of a clear device it has the object in it, just above the gel.
  cv::Mat rest_of(const SeenObject& object, const Eigen::Vector3d& start) const {
    return device.coating ? optics().rest_light : optics().view->rest_light(&object, start);
  }

  DeviceSpec device;
  std::filesystem::path cache_folder;
  VirtualSensorSettings settings;
  std::shared_ptr<const fem::Compliance> gel;
  MarkerPlaces markers;
  mutable std::mutex making;
  mutable std::unique_ptr<const Optics> made;
};

EffectSwitches effects_of(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object) {
  EffectSwitches effects = settings.effects;
  effects.friction = settings.always_friction && object.friction > 0.0 ? Switch::on : Switch::automatic;
  effects.direct_light = Switch::automatic;
  effects.motion_blur = effects.rolling_shutter = Switch::off;  // a touch is shown as it ends
  if (object.elastic) {
    if (!device.gel.relaxation.empty()) effects.elasticity = Elasticity::linear;
    effects.fine_relief = Switch::off;
  }
  return effects;
}

SceneSpec touch_scene(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object,
                      const MotionSpec& motion, bool picture) {
  if (!picture || !device.camera || is_milky(device)) return unseen_scene(device, settings, object, motion);
  return device.coating ? coated_scene(device, settings, object, motion)
                        : clear_scene(device, settings, object, motion);
}

VirtualSensor::VirtualSensor(DeviceSpec device, const std::filesystem::path& cache_folder,
                             const VirtualSensorSettings& settings, const Progress& progress)
    : parts_(std::make_unique<const Parts>(std::move(device), cache_folder, settings, progress)) {}
VirtualSensor::~VirtualSensor() = default;

const DeviceSpec& VirtualSensor::device() const {
  return parts_->device;
}

const fem::Compliance& VirtualSensor::gel() const {
  return *parts_->gel;
}

const LightChoice& VirtualSensor::light() const {
  return parts_->optics().view->choice();
}

double VirtualSensor::mm_per_px() const {
  constexpr double kStep_mm = 0.1;
  const Eigen::Vector2d middle = pixel_from_gel({0, 0});
  const Eigen::Vector2d right = pixel_from_gel({kStep_mm, 0});
  return kStep_mm / (right - middle).norm();
}

Eigen::Vector2d VirtualSensor::pixel_from_gel(const Eigen::Vector2d& place) const {
  const auto pixel = parts_->optics().view->pixel_of({place.x(), place.y(), 0.0});
  if (!pixel) fail("place ({}, {}) mm on the gel isn't seen by the camera", place.x(), place.y());
  return *pixel;
}

Eigen::Vector2d VirtualSensor::gel_from_pixel(const Eigen::Vector2d& pixel) const {
  constexpr double kStep_mm = 0.01;
  constexpr int kMostSteps = 20;
  Eigen::Vector2d place(0, 0);
  for (int step = 0; step < kMostSteps; ++step) {  // Newton's; the map is nearly affine
    const Eigen::Vector2d here = pixel_from_gel(place);
    Eigen::Matrix2d slope;
    slope.col(0) = (pixel_from_gel(place + Eigen::Vector2d(kStep_mm, 0)) - here) / kStep_mm;
    slope.col(1) = (pixel_from_gel(place + Eigen::Vector2d(0, kStep_mm)) - here) / kStep_mm;
    const Eigen::Vector2d change = slope.inverse() * (pixel - here);
    place += change;
    if (change.norm() < 1e-9) break;
  }
  return place;
}

TouchObject VirtualSensor::object(const ObjectSpec& spec) const {
  auto seen = std::make_shared<SeenObject>();
  seen->spec = spec;
  seen->shape = coarse_contact_shape(spec, parts_->device.mesh.fine_mm);
  seen->detailed = contact_shape(spec);
  check_shape(seen->shape);
  seen->warning = size_doubt(parts_->device, spec);
  TouchObject object;
  object.seen_ = std::move(seen);
  return object;
}

MotionSpec VirtualSensor::motion_of(const TouchObject& object, const PressSpec& press) const {
  return parts_->motion_of(*object.seen_, press);
}

std::vector<Truth> VirtualSensor::play(const TouchObject& object, const MotionSpec& motion) const {
  return parts_->play(*object.seen_, motion);
}

TouchSession VirtualSensor::session(const TouchObject& object, const TouchSessionSettings& settings) const {
  if (object.spec().elastic) {
    fail("object {}: is elastic, and a session takes rigid ones; VirtualSensor::press takes both", object.spec().name);
  }
  fem::PressBody body;
  body.shape = object.shape();
  body.friction = object.spec().friction;
  return {*parts_->gel, parts_->device.gel, std::move(body), settings};
}

Touch VirtualSensor::press(const TouchObject& object, const PressSpec& press, const TouchOptions& options) const {
  const std::string what = fmt::format("{}, {} {}", parts_->device.name, object.spec().name, in_words(press));
  try {
    const std::vector<Truth> states = play(object, motion_of(object, press));
    Touch touch;
    touch.what = what;
    add_truth(states.back().press, states.back().error, touch);
    if (options.picture) parts_->show(*object.seen_, states, options, touch);
    return touch;
  } catch (const Error& error) {
    fail("{}: {}", what, error.what());
  }
}

Touch VirtualSensor::press(const ObjectSpec& object_of, const PressSpec& how, const TouchOptions& options) const {
  return press(object(object_of), how, options);
}

Touch VirtualSensor::rest(std::uint64_t noise_seed) const {
  const Optics& by = parts_->optics();
  Touch touch;
  touch.what = fmt::format("{}, untouched", parts_->device.name);
  touch.light = by.rest_light;
  touch.control = by.rest_control;
  touch.contact = cv::Mat::zeros(by.rest_light.size(), CV_8U);
  touch.frame = background(noise_seed);
  touch.background = background(noise_seed ^ kOtherNoise);
  touch.expose = [this](std::uint64_t seed) { return background(seed); };
  return touch;
}

Touch VirtualSensor::capture(const TouchObject& object, const fem::PressState& press, std::uint64_t noise_seed,
                             int frame, bool truth) const {
  const SeenTouch seen = parts_->optics().view->see(*object.seen_, press, press.gel_from_object.translation, truth);
  Touch touch;
  touch.light = seen.light;
  touch.height = seen.height;
  touch.contact = seen.contact;
  const render::Imager imager = parts_->imager_of(*object.seen_);
  touch.control = settled_on(touch.light, imager);
  touch.frame = parts_->develop(touch.light, render::controlled(imager, touch.control), noise_seed, frame);
  return touch;
}

void VirtualSensor::add_truth(const fem::PressState& press, const fem::PressError& error, Touch& touch) const {
  touch.press = press;
  touch.error = error;
  touch.markers_mm = parts_->markers.rest_mm;
  touch.marker_displacement = marker_displacement(parts_->markers, *parts_->gel, press);
}

const Eigen::MatrixX3d& VirtualSensor::marker_places_mm() const {
  return parts_->markers.rest_mm;
}

cv::Mat VirtualSensor::background(std::uint64_t noise_seed, int frame) const {
  const Optics& by = parts_->optics();
  if (!parts_->has_chip()) {
    return parts_->develop(by.rest_light, render::controlled(by.imager, by.rest_control), noise_seed, frame);
  }
  const Plan& plan = by.view->plan();
  const render::MotionChipSettings chip =
      motion_chip(parts_->device, parts_->bands_of(plan.bands), parts_->with_noise(plan));
  return chip_touch(chip, by.rest_light, {}, parts_->settings.seed, noise_seed + static_cast<std::uint64_t>(frame)).raw;
}

const cv::Mat& VirtualSensor::background_light() const {
  return parts_->optics().rest_light;
}

cv::Mat VirtualSensor::linear_numbers(const cv::Mat& light) const {
  return sim::linear_numbers(light, numbers_per_irradiance(parts_->optics().imager));
}

cv::Mat VirtualSensor::with_residual(const ResidualMap& map, const cv::Mat& light, const cv::Mat& height) const {
  if (height.size() != light.size() || height.cols != map.width_px || height.rows != map.height_px) {
    fail("device {}: its picture has {} x {} pixels, the residual map's {} x {}", parts_->device.name, light.cols,
         light.rows, map.width_px, map.height_px);
  }
  return ResidualLight(map, parts_->optics().imager).corrected(light, height);
}

cv::Mat VirtualSensor::ideal(const TouchObject& object, const Touch& touch, const cv::Vec3d& exposure) const {
  render::Imager imager =
      render::controlled(sim::imager(parts_->device, parts_->bands_of(*object.seen_), false), touch.control);
  // The longest exposure for all, of which the others' colours see a part.
  const double longest = std::max({exposure[0], exposure[1], exposure[2]});
  imager.exposure_s *= longest;
  const Eigen::Index channels = imager.quantum_efficiency.rows();
  for (Eigen::Index channel = 0; channel < channels; ++channel) {
    imager.quantum_efficiency.row(channel) *= exposure[static_cast<int>(channels - 1 - channel)] / longest;
  }
  return render::develop(render::expose(touch.light, imager, parts_->optics().pattern, 0, 0), imager);
}

}  // namespace touchstone::sim
