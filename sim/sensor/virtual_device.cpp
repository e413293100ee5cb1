#include "sim/sensor/virtual_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include "core/error.h"
#include "core/units.h"
#include "render/imager/imager.h"
#include "sim/plan/plan.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/touch_rig.h"
#include "sim/view/visible_scene.h"
#include "sim/press/play_motion.h"
#include "sim/press/gel_setup.h"
#include "sim/sensor/virtual_camera.h"

namespace touchstone::sim {
namespace {

constexpr double kClearance_mm = 0.1;  // above the gel, where holds start
constexpr double kFar_mm = 500.0;      // where an object isn't seen
constexpr int kWays = 64;              // from a place to a lower one: with 8 a tilted disc was found 4 um too high
constexpr std::uint64_t kOtherNoise = 0x5bd1e995;  // of the background

std::string in_words(const Hold& hold) {
  std::string words = fmt::format("at ({:g}, {:g}) mm", hold.place_mm.x(), hold.place_mm.y());
  if (!hold.angles_deg.isZero(0.0)) {
    words += fmt::format(" turned by ({:g}, {:g}, {:g}) degrees", hold.angles_deg.x(), hold.angles_deg.y(),
                         hold.angles_deg.z());
  }
  if (hold.force_N) words += fmt::format(" with {:g} N", *hold.force_N);
  if (hold.depth_mm) words += fmt::format(" {:g} mm deep", *hold.depth_mm);
  if (!hold.drag_mm.isZero(0.0)) {
    words += fmt::format(" dragged by ({:g}, {:g}) mm", hold.drag_mm.x(), hold.drag_mm.y());
  }
  return words;
}

void check(const Hold& hold) {
  if (hold.force_N.has_value() == hold.depth_mm.has_value()) {
    fail("a hold has {}; give exactly one of force_N and depth_mm",
         hold.force_N ? "both a force and a depth" : "neither a force nor a depth");
  }
  if (hold.force_N && !(*hold.force_N > 0.0 && std::isfinite(*hold.force_N))) {
    fail("force_N is {}; allowed are numbers above 0", *hold.force_N);
  }
  if (hold.depth_mm && !(*hold.depth_mm > 0.0 && std::isfinite(*hold.depth_mm))) {
    fail("depth_mm is {}; allowed are numbers above 0", *hold.depth_mm);
  }
  if (!hold.place_mm.allFinite() || !hold.angles_deg.allFinite() || !hold.drag_mm.allFinite()) {
    fail("a hold's place_mm, angles_deg and drag_mm must be finite");
  }
}

/// How far above the point of the gel the body is, standing at z = 0.
std::optional<double> height_over(const fem::ContactShape& felt, const RigidTransform& gel_from_object,
                                  const Eigen::Vector3d& point) {
  const RigidTransform object_from_gel = gel_from_object.inverse();
  return first_entry(felt, object_from_gel * point, object_from_gel.turn(Eigen::Vector3d::UnitZ()));
}

HeldFrame of_truth(std::string what, const Truth& truth) {
  HeldFrame held;
  held.what = std::move(what);
  held.force_N = truth.press.wrench.head<3>();
  held.torque_Nmm = truth.press.wrench.tail<3>();
  held.error = truth.error;
  held.press = truth.press;
  return held;
}

/// What the device alone looks like.
ObjectSpec far_ball() {
  ObjectSpec ball;
  ball.name = "nothing";
  ball.shape.radius_mm = 1.0;
  return ball;
}

}  // namespace

double way_to_touch(const fem::ContactShape& felt, const fem::Compliance& gel, const Eigen::Vector2d& place_mm,
                    const Eigen::Vector3d& angles_deg) {
  const RigidTransform gel_from_object{rotation_from_xyz(angles_deg * kRadiansPerDegree),
                                       {place_mm.x(), place_mm.y(), 0.0}};
  std::optional<double> least;
  Eigen::Vector3d where = Eigen::Vector3d::Zero();
  const auto look = [&](const Eigen::Vector3d& point) {
    const auto height = height_over(felt, gel_from_object, point);
    if (!height || (least && *height >= *least)) return false;
    least = height;
    where = point;
    return true;
  };
  Eigen::Vector2d low(0, 0), high(0, 0);
  bool flat = true;
  for (const Eigen::Vector3d& vertex : gel.vertices) {
    look(vertex);
    flat = flat && vertex.z() == 0.0;
    low = low.cwiseMin(vertex.head<2>());
    high = high.cwiseMax(vertex.head<2>());
  }
  if (!flat) {
    if (!least) fail("isn't over the gel");
    return *least;
  }
  // Between a slab's vertices the body may be lower.
  look({std::clamp(place_mm.x(), low.x(), high.x()), std::clamp(place_mm.y(), low.y(), high.y()), 0.0});
  if (!least) fail("isn't over the gel");
  for (double step = 0.5; step > 1e-4; step *= 0.5) {
    for (bool better = true; better;) {
      better = false;
      const Eigen::Vector3d from = where;
      for (int k = 0; k < kWays; ++k) {
        const double angle = 2.0 * kPi * k / kWays;
        const Eigen::Vector3d to = from + step * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
        const bool inside = (to.head<2>().array() >= low.array()).all() && (to.head<2>().array() <= high.array()).all();
        if (inside && look(to)) better = true;
      }
    }
  }
  return *least;
}

MotionSpec press_motion(const Hold& hold, double touch_mm, int drag_frames) {
  check(hold);
  TS_ASSERT(drag_frames >= 1);
  MotionSpec motion;
  motion.start_mm = {hold.place_mm.x(), hold.place_mm.y(), kClearance_mm - touch_mm};
  motion.start_angles_deg = hold.angles_deg;
  MotionKey down;
  down.z = hold.force_N ? AxisKey{std::nullopt, hold.force_N} : AxisKey{-touch_mm - *hold.depth_mm, std::nullopt};
  motion.keys = {down};
  if (!hold.drag_mm.isZero(0.0)) {
    MotionKey along;
    along.frames = drag_frames;
    along.x = AxisKey{hold.place_mm.x() + hold.drag_mm.x(), std::nullopt};
    along.y = AxisKey{hold.place_mm.y() + hold.drag_mm.y(), std::nullopt};
    motion.keys.push_back(along);
  }
  return motion;
}

struct VirtualObject::Parts {
  ObjectSpec spec;
  fem::ContactShape felt;
  std::optional<TouchObject> touching;  // a coated device's
  // A clear device's cameras, one for each start of an object with a screen, which stays there, else a single one.
  struct Sight {
    Truth start;
    std::unique_ptr<const VirtualCamera> camera;
    render::Imager imager;
    render::FixedPattern pattern;
    std::uint64_t seed = 0;
    cv::Mat rest_light;  // of `start`

    cv::Mat expose(const cv::Mat& light, std::uint64_t noise_seed) const {
      return render::develop(render::expose(light, imager, pattern, seed, noise_seed), imager);
    }
  };
  std::mutex making;
  std::map<std::array<double, 3>, std::shared_ptr<const Sight>> sights;
};

const ObjectSpec& VirtualObject::spec() const {
  return parts_->spec;
}

struct VirtualDevice::Parts {
  Parts(DeviceSpec device_of, const std::filesystem::path& cache, const VirtualDeviceSettings& settings_of)
      : device(std::move(device_of)), settings(settings_of) {
    if (!device.camera) fail("device {}: has no camera, so it has no frames", device.name);
    if (device.coating) {
      TouchRigSettings of_rig;
      of_rig.seed = settings.seed;
      of_rig.deepest_mm = settings.deepest_mm;
      of_rig.widest_mm = settings.widest_mm;
      of_rig.membrane_um = settings.membrane_um;
      rig = std::make_unique<const TouchRig>(device, cache, of_rig);
    } else {
      make_plan(scene_of(far_ball(), {}));  // refuses what can't be shown
      clear_gel = set_up_gel(device, cache);
    }
  }

  const fem::Compliance& gel() const { return rig ? rig->gel() : *clear_gel; }

  SceneSpec scene_of(const ObjectSpec& object, const MotionSpec& motion) const {
    SceneSpec scene;
    scene.device = device;
    scene.object = object;
    scene.motion = motion;
    scene.seed = settings.seed;
    scene.outputs = {.frames = true, .radiance = true};
    scene.outputs.contact = true;
    scene.effects.motion_blur = Switch::off;
    scene.effects.rolling_shutter = Switch::off;
    return scene;
  }

  std::vector<Truth> play(const VirtualObject::Parts& object, const MotionSpec& motion) const {
    if (rig) return rig->play(*object.touching, motion);
    const SceneSpec scene = scene_of(object.spec, motion);
    return play_motion(scene, make_plan(scene), *clear_gel);
  }

  std::shared_ptr<const VirtualObject::Parts::Sight> sight(VirtualObject::Parts& object,
                                                           const Eigen::Vector3d& start) const {
    const std::array<double, 3> key =
        object.spec.screen ? std::array<double, 3>{start.x(), start.y(), start.z()} : std::array<double, 3>{};
    const std::lock_guard<std::mutex> lock(object.making);
    auto& kept = object.sights[key];
    if (!kept) {
      MotionSpec still;
      still.start_mm = start;
      const SceneSpec scene = scene_of(object.spec, still);
      const Plan plan = make_plan(scene);
      auto made = std::make_shared<VirtualObject::Parts::Sight>();
      made->start = play_motion(scene, plan, *clear_gel).front();
      made->camera = std::make_unique<const VirtualCamera>(scene, plan, *clear_gel, made->start);
      made->imager = imager(device, plan.bands, plan.sensor_noise);
      made->pattern = render::fixed_pattern(made->imager, {device.camera->width, device.camera->height}, settings.seed);
      made->seed = settings.seed;
      made->rest_light = made->camera->capture(made->start).radiance;
      kept = std::move(made);
    }
    return kept;
  }

  std::string what(const VirtualObject::Parts& object, const Hold& hold) const {
    return fmt::format("{}, {} {}", device.name, object.spec.name, in_words(hold));
  }

  /// The states of a hold, its first one out of contact.
  std::vector<Truth> states(const VirtualObject::Parts& object, const Hold& hold) const {
    check(hold);
    const double touch = way_to_touch(object.felt, gel(), hold.place_mm, hold.angles_deg);
    return play(object, press_motion(hold, touch, settings.drag_frames));
  }

  void look(VirtualObject::Parts& object, const std::vector<Truth>& states, std::uint64_t noise_seed,
            HeldFrame& held) const {
    if (rig) {
      const Touch touch = rig->look(*object.touching, states.back().press, noise_seed);
      held.height = touch.height;
      held.contact = touch.contact;
      show(touch.light, noise_seed, held);
      return;
    }
    const auto seen = sight(object, states.front().press.gel_from_object.translation);
    const Capture capture = seen->camera->capture(states.back());
    cv::Mat contact;
    cv::extractChannel(capture.pixel_truth.image, contact, 0);
    held.contact = contact > 0.5;
    show(seen, capture.radiance, noise_seed, held);
  }

  /// A coated device's frames.
  void show(const cv::Mat& light, std::uint64_t noise_seed, HeldFrame& held) const {
    held.light = light;
    held.expose = [this, light](std::uint64_t seed) { return rig->develop(light, seed); };
    held.frame = held.expose(noise_seed);
    held.background = rig->background(noise_seed ^ kOtherNoise);
  }

  /// A clear one's.
  static void show(const std::shared_ptr<const VirtualObject::Parts::Sight>& seen, const cv::Mat& light,
                   std::uint64_t noise_seed, HeldFrame& held) {
    held.light = light;
    held.expose = [seen, light](std::uint64_t seed) { return seen->expose(light, seed); };
    held.frame = held.expose(noise_seed);
    held.background = seen->expose(seen->rest_light, noise_seed ^ kOtherNoise);
  }

  DeviceSpec device;
  VirtualDeviceSettings settings;
  std::unique_ptr<const TouchRig> rig;               // of a coated device
  std::shared_ptr<const fem::Compliance> clear_gel;  // of the others
  mutable std::mutex making;
  mutable std::shared_ptr<VirtualObject::Parts> nothing;  // of a clear device: what rest() looks at
};

VirtualDevice::VirtualDevice(DeviceSpec device, const std::filesystem::path& cache_folder,
                             const VirtualDeviceSettings& settings)
    : parts_(std::make_unique<const Parts>(std::move(device), cache_folder, settings)) {}
VirtualDevice::~VirtualDevice() = default;

const DeviceSpec& VirtualDevice::device() const {
  return parts_->device;
}

const fem::Compliance& VirtualDevice::gel() const {
  return parts_->gel();
}

VirtualObject VirtualDevice::object(const ObjectSpec& spec) const {
  if (spec.elastic) fail("object {}: is elastic, which takes a scene", spec.name);
  VirtualObject object;
  object.parts_ = std::make_shared<VirtualObject::Parts>();
  object.parts_->spec = spec;
  object.parts_->felt = contact_shape(spec);
  check_shape(object.parts_->felt);
  if (parts_->rig) object.parts_->touching = parts_->rig->object(spec);
  return object;
}

HeldFrame VirtualDevice::feel(const VirtualObject& object, const Hold& hold) const {
  const std::string what = parts_->what(*object.parts_, hold);
  try {
    return of_truth(what, parts_->states(*object.parts_, hold).back());
  } catch (const Error& error) {
    fail("{}: {}", what, error.what());
  }
}

HeldFrame VirtualDevice::press(const VirtualObject& object, const Hold& hold, std::uint64_t noise_seed) const {
  const std::string what = parts_->what(*object.parts_, hold);
  try {
    const std::vector<Truth> states = parts_->states(*object.parts_, hold);
    HeldFrame held = of_truth(what, states.back());
    parts_->look(*object.parts_, states, noise_seed, held);
    return held;
  } catch (const Error& error) {
    fail("{}: {}", what, error.what());
  }
}

HeldFrame VirtualDevice::press(const ObjectSpec& spec, const Hold& hold, std::uint64_t noise_seed) const {
  return press(object(spec), hold, noise_seed);
}

HeldFrame VirtualDevice::rest(std::uint64_t noise_seed) const {
  HeldFrame held;
  held.what = fmt::format("{}, untouched", parts_->device.name);
  if (parts_->rig) {
    parts_->show(parts_->rig->background_light(), noise_seed, held);
  } else {
    std::shared_ptr<VirtualObject::Parts> nothing;
    {
      const std::lock_guard<std::mutex> lock(parts_->making);
      if (!parts_->nothing) parts_->nothing = object(far_ball()).parts_;
      nothing = parts_->nothing;
    }
    const auto seen = parts_->sight(*nothing, {0, 0, kFar_mm});
    held.press = seen->start.press;
    Parts::show(seen, seen->rest_light, noise_seed, held);
  }
  held.contact = cv::Mat::zeros(held.frame.size(), CV_8U);
  return held;
}

}  // namespace touchstone::sim
