#include "sim/sensor/touch_rig.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/sha256.h"
#include "render/cameras/first_hits.h"
#include "sim/plan/plan_direct.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_gel.h"
#include "sim/sensor/light_file.h"
#include "sim/view/seen_geometry.h"
#include "sim/press/play_motion.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_imager.h"

namespace touchstone::sim {
namespace {

constexpr double kClearance_mm = 0.1;  // of the judged ball before its press
constexpr int kRaysAPixel[] = {1};     // of direct light: some milliseconds a frame
constexpr int kPathsAPixel = 256;      // where a device is unfit for direct light

/// States that go as far as the light has to reach: pushed flat to the side and in.
std::vector<Truth> farthest_states(const fem::PressState& rest, const TouchRigSettings& settings) {
  std::vector<Truth> states;
  for (const double side : {-1.0, 1.0}) {
    Truth truth;
    truth.press = rest;
    truth.press.surface_displacement.col(0).setConstant(side * settings.widest_mm);
    truth.press.surface_displacement.col(1).setConstant(side * settings.widest_mm);
    truth.press.surface_displacement.col(2).setConstant(side < 0 ? -settings.deepest_mm : 0.1 * settings.deepest_mm);
    states.push_back(std::move(truth));
  }
  return states;
}

/// A ball that shadows and shades as objects do: what the light's error is measured on.
ObjectSpec judged_ball() {
  constexpr double kRadius_mm = 3.0;
  ObjectSpec ball;
  ball.name = "ball";
  ball.shape.radius_mm = kRadius_mm;
  return ball;
}

MotionSpec straight_press(double from_mm, double to_mm) {
  MotionSpec motion;
  motion.start_mm = {0, 0, from_mm};
  MotionKey key;
  key.z = AxisKey{to_mm, std::nullopt};
  motion.keys = {key};
  return motion;
}

/// Empty where the light isn't to be kept.
std::string light_key(const TouchRigSettings& settings) {
  if (settings.light_key.empty()) return {};
  return sha256_of(fmt::format("touchstone light, format {}, {} {} {} {} {} {} {} {} {}\n{}", kLightFormat,
                               settings.seed, settings.deepest_mm, settings.widest_mm, settings.membrane_um,
                               settings.interreflection_tolerance, settings.always_friction, settings.edge_side,
                               settings.guides.sectors, settings.guides.slices, settings.light_key));
}

/// A rig works as well where it can't be kept.
void keep_light(const std::filesystem::path& folder, const std::string& key, const FoundLight& light) {
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  try {
    write_light(folder, key, light);
  } catch (const Error&) {
  }
}

}  // namespace

struct TouchRig::Parts {
  Parts(DeviceSpec device_of, const std::filesystem::path& cache_folder, const TouchRigSettings& settings_of)
      : device(std::move(device_of)), settings(settings_of) {
    if (!device.camera) fail("device {}: has no camera, so it can't be looked through", device.name);
    if (!device.coating) fail("device {}: has no coating; what shows through its gel needs whole scenes", device.name);
    gel = set_up_gel(device, cache_folder);
    const SceneSpec any = scene_with(judged_ball(), {});
    fit_for_direct = unfit_for_direct_light(any, make_plan(any)).empty();
    const SceneSpec scene = scene_with(judged_ball(), {});
    judged = std::make_shared<const SceneView>(scene, make_plan(scene), *gel);
    const double radius = judged_ball().shape.radius_mm;
    const double above = radius + kClearance_mm;
    rest = at_rest(play(scene_with(judged_ball(), straight_press(above, above))).front().press);
    camera = camera_of(*device.camera);
    ready = render::make_ready(camera);
    size = {render::size_of(camera).x(), render::size_of(camera).y()};
    imager = sim::imager(device, judged->plan.bands, judged->plan.sensor_noise);
    ideal_imager = sim::imager(device, judged->plan.bands, false);
    pattern = render::fixed_pattern(imager, size, settings.seed);
    rest_seen = judged->geometry(rest, {});
    rest_hits = render::first_hits(rest_seen.inside, ready);
    if (judged->plan.direct_light) {
      const std::string key = cache_folder.empty() ? "" : light_key(settings);
      std::optional<FoundLight> found;
      if (!key.empty()) found = read_light(cache_folder, key);
      if (found) {
        direct = std::make_unique<const DirectLight>(*judged, camera, rest, std::move(*found), settings.edge_side);
      } else {
        std::vector<Truth> states = farthest_states(rest, settings);
        states.push_back(
            play(scene_with(judged_ball(), straight_press(above, radius - 0.5 * settings.deepest_mm))).back());
        direct = std::make_unique<const DirectLight>(*judged, camera, states, kRaysAPixel, settings.edge_side,
                                                     settings.guides);
        if (!key.empty()) keep_light(cache_folder, key, direct->found());
      }
      choice = direct->choice();
    }
    background_light = light(*judged, rest, {}, rest_seen);
  }

  SceneSpec scene_with(const ObjectSpec& object, const MotionSpec& motion) const {
    SceneSpec scene;
    scene.device = device;
    scene.object = object;
    scene.motion = motion;
    scene.seed = settings.seed;
    scene.membrane.pixel_um = settings.membrane_um;
    scene.light.interreflection_tolerance = settings.interreflection_tolerance;
    scene.effects.fine_relief = is_gentle(device.gel) ? Switch::on : Switch::off;
    if (settings.always_friction && object.friction > 0.0) scene.effects.friction = Switch::on;
    scene.effects.motion_blur = Switch::off;
    scene.effects.rolling_shutter = Switch::off;
    scene.effects.direct_light = fit_for_direct ? Switch::on : Switch::off;
    return scene;
  }

  std::vector<Truth> play(const SceneSpec& scene) const { return play_motion(scene, make_plan(scene), *gel); }

  /// Irradiance on the sensor. `seen` and `relief` as the sight's geometry() and relief() gave them.
  cv::Mat light(const SceneView& sight, const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief,
                const SeenGeometry& seen) const {
    if (choice.direct) {
      if (auto image = direct->render(sight.seen_coating(press, seen))) return image->irradiance;
      fail("the gel has gone beyond the {} mm in and {} mm aside that the rig was set up for", settings.deepest_mm,
           settings.widest_mm);
    }
    render::RenderSettings paths;
    paths.seed = settings.seed;
    paths.min_samples = paths.max_samples = kPathsAPixel;
    return sight.tracer(press, relief).render(camera, paths).irradiance;
  }

  cv::Mat develop(const cv::Mat& irradiance, std::uint64_t noise_seed, int frame) const {
    return render::develop(render::expose(irradiance, imager, pattern, noise_seed, static_cast<std::uint64_t>(frame)),
                           imager);
  }

  DeviceSpec device;
  TouchRigSettings settings;
  bool fit_for_direct = false;
  std::shared_ptr<const fem::Compliance> gel;
  std::shared_ptr<const SceneView> judged;  // any object's: what the device alone looks like
  fem::PressState rest;
  render::Camera camera;
  render::ReadyCamera ready;
  cv::Size size;
  render::Imager imager, ideal_imager;
  render::FixedPattern pattern;
  SeenGeometry rest_seen;
  std::vector<render::FirstHit> rest_hits;
  std::unique_ptr<const DirectLight> direct;
  LightChoice choice{false, "paths: the device is unfit for direct light", {}};
  cv::Mat background_light;
};

TouchRig::TouchRig(DeviceSpec device, const std::filesystem::path& cache_folder, const TouchRigSettings& settings)
    : parts_(std::make_unique<const Parts>(std::move(device), cache_folder, settings)) {}
TouchRig::~TouchRig() = default;

const DeviceSpec& TouchRig::device() const {
  return parts_->device;
}

const fem::Compliance& TouchRig::gel() const {
  return *parts_->gel;
}

const LightChoice& TouchRig::light() const {
  return parts_->choice;
}

double TouchRig::mm_per_px() const {
  constexpr double kStep_mm = 0.1;
  const Eigen::Vector2d middle = pixel_from_gel({0, 0});
  const Eigen::Vector2d right = pixel_from_gel({kStep_mm, 0});
  return kStep_mm / (right - middle).norm();
}

Eigen::Vector2d TouchRig::pixel_from_gel(const Eigen::Vector2d& place) const {
  const auto pixel =
      render::project_through_faces(parts_->rest_seen.inside, parts_->ready, {place.x(), place.y(), 0.0});
  if (!pixel) fail("place ({}, {}) mm on the gel isn't seen by the camera", place.x(), place.y());
  return *pixel;
}

Eigen::Vector2d TouchRig::gel_from_pixel(const Eigen::Vector2d& pixel) const {
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

TouchObject TouchRig::object(const ObjectSpec& spec) const {
  const SceneSpec scene = parts_->scene_with(spec, {});
  TouchObject object;
  object.sight_ = std::make_shared<const SceneView>(scene, make_plan(scene), *parts_->gel, *parts_->judged);
  return object;
}

std::vector<Truth> TouchRig::play(const TouchObject& object, const MotionSpec& motion) const {
  return parts_->play(parts_->scene_with(object.spec(), motion));
}

Touch TouchRig::look(const TouchObject& object, const fem::PressState& press, std::uint64_t noise_seed, int frame,
                     bool truth) const {
  const SceneView& sight = *object.sight_;
  const auto relief = sight.relief(press);
  const SeenGeometry seen = sight.geometry(press, relief);
  Touch touch;
  touch.light = parts_->light(sight, press, relief, seen);
  touch.frame = parts_->develop(touch.light, noise_seed, frame);
  if (!truth) return touch;
  const std::vector<render::FirstHit> hits = render::first_hits(seen.inside, parts_->ready);
  touch.height = cv::Mat(parts_->size, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  touch.contact = cv::Mat(parts_->size, CV_8U, cv::Scalar(0));
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const render::FirstHit& now = hits[i];
    const render::FirstHit& before = parts_->rest_hits[i];
    if (now.object != 0 || before.object != 0) continue;
    touch.height.ptr<float>()[i] = static_cast<float>(before.position.z() - now.position.z());
    if (seen.sheet.touched[static_cast<std::size_t>(now.triangle)] >= 0) touch.contact.ptr<std::uint8_t>()[i] = 255;
  }
  return touch;
}

cv::Mat TouchRig::background(std::uint64_t noise_seed, int frame) const {
  return parts_->develop(parts_->background_light, noise_seed, frame);
}

const cv::Mat& TouchRig::background_light() const {
  return parts_->background_light;
}

cv::Mat TouchRig::ideal(const cv::Mat& light) const {
  return render::develop(render::expose(light, parts_->ideal_imager, parts_->pattern, 0, 0), parts_->ideal_imager);
}

cv::Mat TouchRig::develop(const cv::Mat& light, std::uint64_t noise_seed, int frame) const {
  return parts_->develop(light, noise_seed, frame);
}

}  // namespace touchstone::sim
