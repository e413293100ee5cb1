#include "lab/reflex/reflex_light.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "render/cameras/lens_camera.h"
#include "render/cameras/pinhole_camera.h"
#include "sim/plan/plan.h"
#include "sim/plan/plan_direct.h"
#include "sim/scene/device_camera.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

constexpr double kSpare_mm = 0.05;  // beyond the skins that were named

/// The same view with `times` as many pixels along each axis.
render::Camera finer(render::Camera camera, int times) {
  std::visit(
      [times](auto& one) {
        one.width *= times;
        one.height *= times;
        one.pixel_pitch_um /= times;
        if constexpr (std::is_same_v<std::decay_t<decltype(one)>, render::LensCamera>) {
          one.matrix.fx *= times;
          one.matrix.fy *= times;
          one.matrix.cx = (one.matrix.cx + 0.5) * times - 0.5;
          one.matrix.cy = (one.matrix.cy + 0.5) * times - 0.5;
        }
      },
      camera);
  return camera;
}

Eigen::AlignedBox3d box_of(const sim::GelSheet& skin) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : skin.mesh.vertices) box.extend(vertex);
  return box;
}

/// What reflects nothing needs no light and may stand outside of the light field.
void make_black(render::Surface& surface) {
  const auto* matt = std::get_if<render::Lambertian>(&surface.material);
  if (matt != nullptr && !surface.print && (matt->albedo == 0.0).all()) surface.material = render::Black{};
}

}  // namespace

sim::VisibleGel visible_skin(const fem::FiniteGel& gel, const fem::GelBody& body) {
  fem::Compliance outer;  // of which only the surface is asked for
  outer.thickness = gel.thickness;
  for (const int vertex : gel.outer.mesh_vertex) outer.vertices.push_back(gel.mesh.vertices[vertex]);
  outer.triangles = gel.outer.triangles;
  outer.mass = gel.mass;
  return sim::VisibleGel(outer, body);
}

sim::GelSheet skin_sheet(const sim::VisibleGel& skin, const fem::PressState& press, const fem::ContactShape& object) {
  const sim::PlacedShape placed{object, press.gel_from_object};
  return skin.sheet(press, {&placed, 1});
}

struct ReflexLight::Parts {
  Parts(const sim::DeviceSpec& device, const sim::GelSheet& rest, std::span<const sim::GelSheet> reached,
        const ReflexLightSettings& settings_of)
      : settings(settings_of) {
    if (!device.camera) fail("device {}: has no camera, so it can't be looked through", device.name);
    if (!device.coating) fail("device {}: has no coating; its skin can't be seen from within", device.name);
    if (settings.side < 1 || settings.side > 16 || settings.rays < 1 || settings.rays > 64) {
      fail("reflex light: {0}x{0} parts of {1} rays a pixel; allowed are 1 to 16 and 1 to 64", settings.side,
           settings.rays);
    }
    if (reached.empty()) fail("reflex light: no skin says how far the light has to reach");
    scene.device = device;
    scene.lamp_level = settings.lamp_level;
    plan = sim::make_plan(scene);
    camera = sim::camera_of(*device.camera);
    fine_camera = finer(camera, settings.side);
    if (settings.lamp_level == 0.0) return;  // nothing to draw
    if (const std::string unfit = sim::unfit_for_direct_light(scene, plan); !unfit.empty()) {
      fail("device {}: direct light can't draw it: {}", device.name, unfit);
    }
    Eigen::AlignedBox3d reach = box_of(rest);
    for (const sim::GelSheet& skin : reached) reach.extend(box_of(skin));
    reach.min().array() -= kSpare_mm;
    reach.max().array() += kSpare_mm;
    reach.min().z() = std::max(reach.min().z(), -device.gel.thickness_mm);
    render::DirectChoiceSettings choice;
    choice.whatever = true;
    choice.direct.samples = settings.rays;
    choice.direct.seed = choice.error.seed = choice.rest.seed = settings.seed;
    rest_scene = seen(rest);
    render::DirectChoice chosen = render::choose_direct(rest_scene, seen(reached.front()), fine_camera, reach, choice);
    if (!chosen.renderer) fail("device {}: direct light can't draw it: {}", device.name, chosen.reason);
    direct = choice.direct;
    error = chosen.error;
    field = std::move(chosen.field);
    bounced = chosen.bounced;
    rest_scene.interreflection = false;
    idle.push_back(std::move(chosen.renderer));
  }

  render::Scene seen(const sim::GelSheet& skin) const {
    render::Scene out = sim::scene_in_coating(scene, plan, fem::PressState{});
    out.surfaces.insert(out.surfaces.begin(), sim::coated_surface(scene, plan, skin));
    for (render::Surface& surface : out.surfaces) make_black(surface);
    return out;
  }

  std::unique_ptr<render::DirectRenderer> borrow() {
    {
      const std::lock_guard lock(mutex);
      if (!idle.empty()) {
        auto renderer = std::move(idle.back());
        idle.pop_back();
        return renderer;
      }
    }
    auto renderer = std::make_unique<render::DirectRenderer>(field, fine_camera, rest_scene, direct);
    renderer->set_bounced_light(bounced);
    return renderer;
  }

  cv::Mat draw(const sim::GelSheet& skin) {
    if (!field.reach.contains(box_of(skin))) fail("the skin has gone beyond what the light was set up for");
    const render::Scene pressed = seen(skin);
    return tbb::this_task_arena::isolate([&] {
      auto renderer = borrow();
      cv::Mat drawn = renderer->render(pressed).irradiance;
      const std::lock_guard lock(mutex);
      idle.push_back(std::move(renderer));
      return drawn;
    });
  }

  ReflexLightSettings settings;
  sim::SceneSpec scene;
  sim::Plan plan;
  render::Camera camera, fine_camera;
  render::Scene rest_scene;
  render::LightField field;
  cv::Mat bounced;
  render::DirectSettings direct;
  render::DirectError error;
  std::mutex mutex;
  std::vector<std::unique_ptr<render::DirectRenderer>> idle;  // a renderer serves one thread at a time
};

ReflexLight::ReflexLight(const sim::DeviceSpec& device, const sim::GelSheet& rest,
                         std::span<const sim::GelSheet> reached, const ReflexLightSettings& settings)
    : parts_(std::make_unique<Parts>(device, rest, reached, settings)) {}
ReflexLight::~ReflexLight() = default;
ReflexLight::ReflexLight(ReflexLight&&) noexcept = default;

const sim::DeviceSpec& ReflexLight::device() const {
  return parts_->scene.device;
}

const sim::SceneBands& ReflexLight::bands() const {
  return parts_->plan.bands;
}

const render::DirectError& ReflexLight::error() const {
  return parts_->error;
}

cv::Mat ReflexLight::irradiance(const sim::GelSheet& skin) const {
  const sim::CameraSpec& camera = *parts_->scene.device.camera;
  const cv::Size size(camera.width, camera.height);
  if (parts_->settings.lamp_level == 0.0) {
    return cv::Mat(size, CV_32FC(static_cast<int>(bands().count())), cv::Scalar::all(0.0));
  }
  const cv::Mat fine = parts_->draw(skin);
  cv::Mat light;
  cv::resize(fine, light, size, 0, 0, cv::INTER_AREA);
  return light;
}

cv::Mat ReflexLight::traced(const sim::GelSheet& skin, int paths, std::uint64_t seed) const {
  render::RenderSettings settings;
  settings.seed = seed;
  settings.min_samples = settings.max_samples = paths;
  return render::Tracer(parts_->seen(skin)).render(parts_->camera, settings).irradiance;
}

}  // namespace touchstone::lab
