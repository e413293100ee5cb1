#include "sim/sensor/coated_view.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/locked_work.h"
#include "core/sha256.h"
#include "render/cameras/first_hits.h"
#include "render/cameras/still_view.h"
#include "sim/plan/plan_direct.h"
#include "sim/press/play_motion.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_imager.h"
#include "sim/sensor/background_light.h"
#include "sim/sensor/colour_numbers.h"
#include "sim/sensor/direct_light.h"
#include "sim/sensor/light_file.h"
#include "sim/sensor/milky_coat.h"
#include "sim/sensor/residual_light.h"
#include "sim/sensor/virtual_sensor.h"
#include "sim/view/seen_geometry.h"

namespace touchstone::sim {
namespace {

constexpr double kClearance_mm = 0.1;     // of the judged ball before its press
constexpr int kRaysAPixel[] = {1};        // of direct light: some milliseconds a frame
constexpr int kPathsAPixel = 256;         // where a device is unfit for direct light
constexpr double kMilkyTolerance = 0.05;  // of pictures of a milky slab: beyond it, paths

/// How far a point of the surface moves along z where the gel is pressed in by `depth_mm` (negative: inwards). A
/// fingertip's sides, which begin on the plate that it is bonded to, hardly move; nor does the rim of a dome that ends
/// on the plate, or of a fingertip that is held up to its hemisphere.
double pressed_mm(const GelSpec& gel, double z_mm, double depth_mm) {
  if (ends_on_plate(gel)) return std::max(depth_mm, std::min(0.0, -0.5 * (z_mm + gel.thickness_mm)));
  const FingertipSpec* const fingertip = gel.fingertip();
  if (fingertip == nullptr) return depth_mm;
  const double held_mm = gel.thickness_mm - fingertip->sleeve_mm;
  constexpr double kRounding_mm = 1e-6;
  if (held_mm <= fingertip->radius_mm + kRounding_mm) return std::max(depth_mm, std::min(0.0, -0.5 * (z_mm + held_mm)));
  return depth_mm * std::clamp((z_mm + held_mm) / (held_mm - fingertip->radius_mm), 0.0, 1.0);
}

/// States that go as far as the light has to reach: pushed flat to the side and in.
std::vector<Truth> farthest_states(const fem::PressState& rest, const VirtualSensorSettings& settings,
                                   const fem::Compliance& compliance, const GelSpec& gel) {
  std::vector<Truth> states;
  for (const double side : {-1.0, 1.0}) {
    Truth truth;
    truth.press = rest;
    truth.press.surface_displacement.col(0).setConstant(side * settings.widest_mm);
    truth.press.surface_displacement.col(1).setConstant(side * settings.widest_mm);
    const double depth_mm = side < 0 ? -settings.deepest_mm : 0.1 * settings.deepest_mm;
    for (std::size_t i = 0; i < compliance.vertices.size(); ++i) {
      truth.press.surface_displacement(static_cast<Eigen::Index>(i), 2) =
          pressed_mm(gel, compliance.vertices[i].z(), depth_mm);
    }
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

/// `direct`: shown by direct light, else by paths.
SceneSpec scene_with(const DeviceSpec& device, const VirtualSensorSettings& settings, bool direct,
                     const ObjectSpec& object, const MotionSpec& motion) {
  SceneSpec scene;
  scene.device = device;
  scene.object = object;
  scene.motion = motion;
  scene.seed = settings.seed;
  scene.membrane.pixel_um = settings.membrane_um;
  scene.light.interreflection_tolerance = settings.interreflection_tolerance;
  scene.effects = effects_of(device, settings, object);
  if (!takes_fine_relief(device.gel)) scene.effects.fine_relief = Switch::off;
  if (scene.effects.fine_relief == Switch::automatic) scene.effects.fine_relief = Switch::on;
  scene.effects.direct_light = direct ? Switch::on : Switch::off;
  return scene;
}

bool is_fit_for_direct_light(const DeviceSpec& device, const VirtualSensorSettings& settings) {
  const SceneSpec any = scene_with(device, settings, false, judged_ball(), {});
  return unfit_for_direct_light(any, make_plan(any)).empty();
}

/// Empty where the light isn't to be kept.
std::string light_key(const VirtualSensorSettings& settings) {
  if (settings.light_key.empty()) return {};
  const EffectSwitches& effects = settings.effects;
  std::string switches;
  for (const Switch one :
       {effects.interreflection, effects.translucent_coating, effects.fine_relief, effects.diffraction}) {
    switches += fmt::format(" {}", static_cast<int>(one));
  }
  return sha256_of(fmt::format("touchstone light, format {}, {} {} {} {} {} {} {} {} {} {}{}\n{}", kLightFormat,
                               settings.seed, settings.deepest_mm, settings.widest_mm, settings.membrane_um,
                               settings.interreflection_tolerance, settings.always_friction, settings.edge_side,
                               settings.guides.sectors, settings.guides.slices, settings.field_accuracy, switches,
                               settings.light_key));
}

/// What `made` makes of what was kept; nothing where nothing was, or where it's another sensor's: then it's made anew.
template <typename Light, typename Found, typename Make>
std::unique_ptr<const Light> kept(std::optional<Found> found, const Make& made) {
  if (!found) return nullptr;
  try {
    return made(*found);
  } catch (const Error&) {
    return nullptr;
  }
}

/// A sensor works as well where its light can't be kept.
template <typename Write>
void keep(const std::filesystem::path& folder, const Write& write) {
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  try {
    write();
  } catch (const Error&) {
  }
}

class CoatedView final : public SensorView {
 public:
  CoatedView(const DeviceSpec& device, const fem::Compliance& gel, const std::filesystem::path& cache_folder,
             const VirtualSensorSettings& settings)
      : device_(device), gel_(gel), settings_(settings) {
    fit_for_direct_ = is_fit_for_direct_light(device_, settings_);
    const SceneSpec scene = scene_with(judged_ball(), {});
    judged_ = std::make_shared<const SceneView>(scene, make_plan(scene), gel_);
    const double radius = judged_ball().shape.radius_mm;
    const double above = radius + kClearance_mm;
    rest_ = at_rest(play(straight_press(above, above)).front().press);
    camera_ = planned_camera(judged_->scene, judged_->plan);
    ready_ = render::make_ready(camera_);
    rest_seen_ = judged_->geometry(rest_, {});
    // Sheet and frame: then the sheet alone moves.
    if (rest_seen_.inside.surfaces.size() == 2 && rest_seen_.inside.balls.empty()) {
      still_ = std::make_unique<const render::StillView>(rest_seen_.inside, ready_);
    }
    rest_hits_ = first_hits(rest_seen_.inside);
    if (judged_->plan.direct_light) {
      const std::string key = cache_folder.empty() ? "" : light_key(settings_);
      if (!key.empty()) {
        direct_ = kept<DirectLight>(read_light(cache_folder, key), [&](FoundLight& found) {
          return std::make_unique<const DirectLight>(*judged_, camera_, rest_, std::move(found), settings_.edge_side);
        });
      }
      if (direct_ == nullptr) {
        std::vector<Truth> states = farthest_states(rest_, settings_, gel_, device_.gel);
        states.push_back(play(straight_press(above, radius - 0.5 * settings_.deepest_mm)).back());
        DirectLightSettings wanted;
        wanted.rays = kRaysAPixel;
        wanted.edge_side = settings_.edge_side;
        wanted.guides = settings_.guides;
        wanted.field_accuracy = settings_.field_accuracy;
        direct_ = std::make_unique<const DirectLight>(*judged_, camera_, states, wanted);
        if (!key.empty()) keep(cache_folder, [&] { write_light(cache_folder, key, direct_->found()); });
      }
      choice_ = direct_->choice();
    } else if (judged_->plan.scattering) {
      set_up_milky(cache_folder, above);
    }
    const cv::Mat own = light(*judged_, rest_, {}, rest_seen_).irradiance;
    if (!device_.background.empty()) {
      const render::Imager ideal = imager(device_, judged_->plan.bands, false);
      irradiance_per_number_ = irradiance_per_number(ideal);
      missing_at_rest_ = missing_at_rest(device_.background, own, ideal);
    }
    rest_light_ = with_background(own);
    if (device_.residual) {
      lacking_.emplace(*device_.residual, imager(device_, judged_->plan.bands, false));
      choice_.reason += "; residual map: " + in_words(*device_.residual);
    }
  }

  const Plan& plan() const override { return judged_->plan; }
  const LightChoice& choice() const override { return choice_; }

  SeenTouch see(const SeenObject& object, const fem::PressState& press, const Eigen::Vector3d&,
                bool truth) const override {
    const SceneView& view = view_of(object);
    const auto relief = view.relief(press);
    const SeenGeometry seen = view.geometry(press, relief);
    SeenTouch touch;
    const render::DirectImage image = light(view, press, relief, seen);
    touch.light = with_background(image.irradiance);
    if (!truth && !lacking_) return touch;
    const std::vector<render::FirstHit> hits = first_hits(seen.inside, image.sheet_triangle);
    const cv::Mat height = pressed_in(rest_hits_, hits, touch.light.size());
    if (lacking_) touch.light = lacking_->corrected(touch.light, height);
    if (!truth) return touch;
    touch.height = height;
    touch.contact = in_contact(rest_hits_, hits, seen.sheet, height.size());
    return touch;
  }

  std::optional<LightOfKeys> light_of_keys(const SeenObject& object) const override {
    if (!choice_.direct || !direct_->has_points()) return std::nullopt;
    if (!missing_at_rest_.empty() || lacking_) return std::nullopt;
    const SceneView& view = view_of(object);
    if (!unfit_for_light_between(view.scene, view.plan).empty()) return std::nullopt;
    return LightOfKeys{view, *direct_, {}};
  }

  cv::Mat rest_light(const SeenObject*, const Eigen::Vector3d&) const override { return rest_light_; }

  std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& point) const override {
    return render::project_through_faces(rest_seen_.inside, ready_, point);
  }

 private:
  /// Pictures from maps, where they are found to be good enough.
  void set_up_milky(const std::filesystem::path& cache_folder, double above_mm) {
    const std::string unfit = unfit_for_milky_coat(device_, judged_->seen(rest_, std::nullopt));
    if (!unfit.empty()) {
      choice_.reason = "paths: " + unfit;
      return;
    }
    const std::string key = cache_folder.empty() ? "" : light_key(settings_);
    if (!key.empty()) {
      milky_ = kept<MilkyCoat>(read_traced(cache_folder, key), [&](TracedSlab& traced) {
        return std::make_unique<const MilkyCoat>(*judged_, camera_, rest_, settings_.seed, std::move(traced));
      });
    }
    if (milky_ == nullptr) {
      auto found = std::make_unique<MilkyCoat>(*judged_, camera_, rest_, settings_.seed);
      const double lowest = judged_ball().shape.radius_mm - 0.5 * settings_.deepest_mm;
      const fem::PressState press = play(straight_press(above_mm, lowest)).back().press;
      found->measure(*judged_, press, judged_->geometry(press, judged_->relief(press)), camera_, settings_.seed);
      if (!key.empty()) keep(cache_folder, [&] { write_traced(cache_folder, key, found->traced()); });
      milky_ = std::move(found);
    }
    const render::DirectError& error = milky_->traced().error;
    choice_.error = error;
    const std::string off =
        fmt::format("{:.2g} % off path tracing under a ball (+- {:.1g} %)", 100 * error.rms, 100 * error.rms_error);
    if (render::largest_rms(error) <= kMilkyTolerance) {
      choice_.reason = "maps: the gel is milky under a coat (sim/sensor/milky_coat.h); " + off;
    } else {
      choice_.reason = fmt::format("paths: maps are {}, allowed are {:.2g} %", off, 100 * kMilkyTolerance);
      milky_.reset();
    }
  }

  const SceneView& view_of(const SeenObject& object) const {
    locked_work(object.making, [&] {
      if (object.view) return;
      const SceneSpec scene = scene_with(object.spec, {});
      object.view = std::make_shared<const SceneView>(scene, make_plan(scene), gel_, *judged_);
    });
    return *object.view;
  }

  cv::Mat with_background(const cv::Mat& light) const {
    return missing_at_rest_.empty() ? light : with_numbers(light, missing_at_rest_, irradiance_per_number_);
  }

  SceneSpec scene_with(const ObjectSpec& object, const MotionSpec& motion) const {
    return sim::scene_with(device_, settings_, fit_for_direct_, object, motion);
  }

  std::vector<Truth> play(const MotionSpec& motion) const {
    const SceneSpec scene = scene_with(judged_ball(), motion);
    return play_motion(scene, make_plan(scene), gel_);
  }

  /// `sheet_triangle`: what the light met of the sheet, the same as in `inside`; may be empty.
  std::vector<render::FirstHit> first_hits(const render::Scene& inside,
                                           std::span<const std::int32_t> sheet_triangle = {}) const {
    return still_ ? still_->first_hits(inside.surfaces[0], sheet_triangle) : render::first_hits(inside, ready_);
  }

  /// Irradiance on the sensor. `seen` and `relief` as the view's geometry() and relief() gave them.
  render::DirectImage light(const SceneView& view, const fem::PressState& press,
                            const std::optional<fem::ReliefAnswer>& relief, const SeenGeometry& seen) const {
    if (choice_.direct) {
      if (auto image = direct_->render(view.seen_coating(press, seen))) return std::move(*image);
      fail("the gel has gone beyond the {} mm in and {} mm aside that the sensor was set up for", settings_.deepest_mm,
           settings_.widest_mm);
    }
    render::DirectImage image;
    if (milky_) {
      image.irradiance = milky_->irradiance(seen.inside.surfaces.front().mesh);
      return image;
    }
    render::RenderSettings paths;
    paths.seed = settings_.seed;
    paths.min_samples = paths.max_samples = kPathsAPixel;
    image.irradiance = view.tracer(press, relief).render(camera_, paths).irradiance;
    return image;
  }

  DeviceSpec device_;
  const fem::Compliance& gel_;
  VirtualSensorSettings settings_;
  bool fit_for_direct_ = false;
  std::shared_ptr<const SceneView> judged_;  // any object's: what the device alone looks like
  fem::PressState rest_;
  render::Camera camera_;
  render::ReadyCamera ready_;
  SeenGeometry rest_seen_;
  std::unique_ptr<const render::StillView> still_;  // null where more than the sheet moves
  std::vector<render::FirstHit> rest_hits_;
  std::unique_ptr<const DirectLight> direct_;
  std::unique_ptr<const MilkyCoat> milky_;  // in place of paths
  LightChoice choice_{false, "paths: the device is unfit for direct light", {}};
  cv::Mat rest_light_;
  cv::Mat missing_at_rest_;  // of a device with a background
  Eigen::MatrixX3d irradiance_per_number_;
  std::optional<ResidualLight> lacking_;  // none at rest
};

}  // namespace

SceneSpec coated_scene(const DeviceSpec& device, const VirtualSensorSettings& settings, const ObjectSpec& object,
                       const MotionSpec& motion) {
  return scene_with(device, settings, is_fit_for_direct_light(device, settings), object, motion);
}

std::unique_ptr<const SensorView> coated_view(const DeviceSpec& device, const fem::Compliance& gel,
                                              const std::filesystem::path& cache_folder,
                                              const VirtualSensorSettings& settings) {
  return std::make_unique<const CoatedView>(device, gel, cache_folder, settings);
}

}  // namespace touchstone::sim
