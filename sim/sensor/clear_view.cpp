#include "sim/sensor/clear_view.h"

#include <array>
#include <opencv2/core.hpp>
#include <utility>

#include "core/error.h"
#include "core/locked_work.h"
#include "render/cameras/first_hits.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_camera.h"
#include "sim/scene/device_faces.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/visible_scene.h"

namespace touchstone::sim {
namespace {

constexpr double kFar_mm = 500.0;  // where an object isn't seen

/// What stands far away where the device is seen alone.
ObjectSpec far_ball() {
  ObjectSpec ball;
  ball.name = "nothing";
  ball.shape.radius_mm = 1.0;
  return ball;
}

class ClearView final : public SensorView {
 public:
  ClearView(const DeviceSpec& device, const fem::Compliance& gel, const VirtualSensorSettings& settings)
      : device_(device), gel_(gel), settings_(settings), plan_(make_plan(scene_of(far_ball(), {}))) {
    choice_.reason = plan_.shared_paths ? "paths, shared between pixels: the gel is clear" : "paths: the gel is clear";
    nothing_.spec = far_ball();
    // What a point of the gel projects to needs the device's faces and media alone.
    still_ = render::make_ready(camera_of(*device_.camera));
    faces_ = clear_layers(device_);
  }

  const Plan& plan() const override { return plan_; }
  const LightChoice& choice() const override { return choice_; }

  SceneBands bands(const SeenObject& object) const override {
    return locked_work(object.making, [&] {
      if (!object.bands) object.bands = make_plan(scene_of(object.spec, {})).bands;
      return *object.bands;
    });
  }

  SeenTouch see(const SeenObject& object, const fem::PressState& press, const Eigen::Vector3d& start_mm,
                bool truth) const override {
    Truth now;
    now.press = press;
    const Capture capture = camera(object, start_mm)->capture(now);
    SeenTouch seen;
    seen.light = capture.radiance;
    if (truth) {
      cv::Mat contact;
      cv::extractChannel(capture.pixel_truth.image, contact, 0);
      seen.contact = contact > 0.5;
    }
    return seen;
  }

  cv::Mat rest_light(const SeenObject* object, const Eigen::Vector3d& start_mm) const override {
    const SeenObject& shown = object != nullptr ? *object : nothing_;
    const Eigen::Vector3d start = object != nullptr ? start_mm : Eigen::Vector3d(0, 0, kFar_mm);
    return camera(shown, start)->capture(start_of(shown, start)).radiance;
  }

  std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& point) const override {
    return render::project_through_faces(faces_, still_, point);
  }

 private:
  SceneSpec scene_of(const ObjectSpec& object, const MotionSpec& motion) const {
    return clear_scene(device_, settings_, object, motion);
  }

  Truth start_of(const SeenObject& object, const Eigen::Vector3d& start) const {
    MotionSpec still;
    still.start_mm = start;
    ObjectSpec rigid = object.spec;
    rigid.elastic.reset();  // nothing touches it yet
    const SceneSpec scene = scene_of(rigid, still);
    return play_motion(scene, make_plan(scene), gel_).front();
  }

  /// One for each start of an object with a screen, which stays there; else a single one.
  std::shared_ptr<const VirtualCamera> camera(const SeenObject& object, const Eigen::Vector3d& start) const {
    const std::array<double, 3> key =
        object.spec.screen ? std::array<double, 3>{start.x(), start.y(), start.z()} : std::array<double, 3>{};
    return locked_work(object.making, [&] {
      auto& kept = object.cameras[key];
      if (!kept) {
        MotionSpec still;
        still.start_mm = start;
        const SceneSpec scene = scene_of(object.spec, still);
        kept = std::make_shared<const VirtualCamera>(scene, make_plan(scene), gel_, start_of(object, start));
      }
      return kept;
    });
  }

  DeviceSpec device_;
  const fem::Compliance& gel_;
  VirtualSensorSettings settings_;
  Plan plan_;
  LightChoice choice_;
  render::ReadyCamera still_;
  render::Scene faces_;
  SeenObject nothing_;
};

}  // namespace

SceneSpec clear_scene(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object,
                      const MotionSpec& motion) {
  SceneSpec scene;
  scene.device = device;
  scene.object = object;
  scene.motion = motion;
  scene.seed = settings.seed;
  scene.outputs = {.frames = true, .radiance = true};
  scene.outputs.contact = true;
  scene.effects = effects_of(device, settings, object);
  return scene;
}

std::unique_ptr<const SensorView> clear_view(const DeviceSpec& device, const fem::Compliance& gel,
                                             const VirtualSensorSettings& settings) {
  return std::make_unique<const ClearView>(device, gel, settings);
}

}  // namespace touchstone::sim
