#include "sim/sensor/direct_light.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "render/direct/wide_lamps.h"
#include "render/imager/mean_electrons.h"
#include "render/scene/film_screen.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/light_limits.h"

namespace touchstone::sim {
namespace {

constexpr double kSpareReach = 0.25;    // of the widest displacement, for states that weren't looked at
constexpr double kSpareReachMm = 0.05;  // and for what is laid onto a body
constexpr double kRounding_mm = 1e-9;   // of a rim that lies on the plate, as the box ends there
constexpr int kPathsToMeasure = 256;    // a pixel, for a standard error of a tenth of a percent

/// What reflects nothing needs no light: it may stand outside of the light field. Wide lamps are cut.
render::Scene for_direct_light(render::Scene scene) {
  render::cut_wide_lamps(scene.lamps);
  for (render::Surface& surface : scene.surfaces) {
    const auto* matt = std::get_if<render::Lambertian>(&surface.material);
    if (matt != nullptr && !surface.print && (matt->albedo == 0.0).all()) surface.material = render::Black{};
  }
  return scene;
}

Eigen::AlignedBox3d lit_box(const render::Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const render::Surface& surface : scene.surfaces) {
    if (std::holds_alternative<render::Black>(surface.material) || render::is_film(surface)) continue;
    for (const auto& vertex : surface.mesh.vertices) box.extend(vertex);
  }
  for (const render::Ball& ball : scene.balls) {
    box.extend(Eigen::Vector3d(ball.centre.array() - ball.radius));
    box.extend(Eigen::Vector3d(ball.centre.array() + ball.radius));
  }
  return box;
}

/// From and to which displacement all points of the surface and beads go in all states.
Eigen::AlignedBox3d displacements(std::span<const Truth> truths) {
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  for (const Truth& truth : truths) {
    for (const Eigen::MatrixX3d* field : {&truth.press.surface_displacement, &truth.press.bead_displacement}) {
      if (field->rows() == 0) continue;
      box.extend(Eigen::Vector3d(field->colwise().minCoeff().transpose()));
      box.extend(Eigen::Vector3d(field->colwise().maxCoeff().transpose()));
    }
  }
  return box;
}

/// The box that lit things stay in.
Eigen::AlignedBox3d reach_of(const render::Scene& rest, const render::Scene& pressed, std::span<const Truth> truths,
                             double back_z) {
  const Eigen::AlignedBox3d still = lit_box(rest);
  const Eigen::AlignedBox3d displacement = displacements(truths);
  const double spare = kSpareReachMm + kSpareReach * displacement.sizes().maxCoeff();
  Eigen::AlignedBox3d box(still.min() + displacement.min(), still.max() + displacement.max());
  box.extend(lit_box(pressed));
  box.min().array() -= spare;
  box.max().array() += spare;
  box.min().z() = std::max(box.min().z(), back_z);
  return box;
}

/// How far from the axis the gel is lit, where it's a dome that ends on its plate: the corners of its box are next to
/// lamps in the plate, whose light is steep there. 0 of others.
double lit_radius(const GelSpec& gel, const Eigen::AlignedBox3d& reach) {
  if (!ends_on_plate(gel)) return 0.0;
  const Eigen::Array2d far = reach.min().head<2>().cwiseAbs().cwiseMax(reach.max().head<2>().cwiseAbs());
  return far.maxCoeff();
}

/// Of light that isn't within its limit: what that is, and what paths would leave where that was measured.
std::string beside_the_limit(const LightLimits& limits, const render::DirectChoice& chosen) {
  std::string words = fmt::format("; allowed are {}", direct_limit_in_words(limits));
  if (chosen.paths_noise)
    words += fmt::format(", and {} paths a pixel would leave some {:.2g}", limits.max_samples, *chosen.paths_noise);
  return words;
}

std::string with_figures(const std::string& verdict, const render::DirectChoice& chosen) {
  std::string text =
      fmt::format("{}: {:.2f} +- {:.2f} % ", verdict, 100 * chosen.error.rms, 100 * chosen.error.rms_error);
  if (chosen.seen_error) {
    text += fmt::format("and {:.2f} +- {:.2f} of the imager's noise ", chosen.seen_error->rms,
                        chosen.seen_error->rms_error);
  }
  return text +
         fmt::format("off path tracing (root mean square over {} pixels of the deepest press)", chosen.error.pixels);
}

/// Light as electrons in units of their noise: the root's slope is one over it.
cv::Mat in_units_of_noise(const cv::Mat& light, const std::vector<render::ImagerResponse>& channels) {
  cv::Mat seen = render::mean_electrons(light, channels);
  const int count = static_cast<int>(channels.size());
  for (int row = 0; row < seen.rows; ++row) {
    auto* values = seen.ptr<float>(row);
    for (int i = 0; i < seen.cols * count; ++i) {
      const render::ImagerResponse& one = channels[static_cast<std::size_t>(i % count)];
      const double level = std::min<double>(values[i], one.full_well_e);
      const double dark = render::noise_e(one, 0.0);
      values[i] = static_cast<float>(2.0 * std::sqrt(std::max(0.0, level) + dark * dark));
    }
  }
  return seen;
}

}  // namespace

namespace {

/// What choose_direct chooses for.
struct AskedLight {
  render::Scene rest, pressed;
  Eigen::AlignedBox3d reach;
  render::DirectChoiceSettings settings;

  AskedLight(const SceneView& view, std::span<const Truth> truths, const std::optional<fem::ReliefAnswer>* relief)
      : rest(for_direct_light(view.seen(at_rest(truths.front().press), {}))) {
    const Truth& judged = deepest(truths);
    pressed = for_direct_light(view.seen(judged.press, relief != nullptr ? *relief : view.relief(judged.press)));
    reach = reach_of(rest, pressed, truths, -view.scene.device.gel.thickness_mm);
    const LightLimits limits = light_limits(view.scene);
    settings.tolerance = limits.direct_tolerance;
    if (limits.direct_noise) {
      const auto channels = render::channel_responses(imager(view.scene.device, view.plan.bands, true));
      settings.field_accuracy = render::light_field_settings(rest, reach, settings).accuracy;
      settings.tolerance = *limits.direct_noise;
      settings.paths = limits.max_samples;
      settings.error.seen = [channels](const cv::Mat& light) { return in_units_of_noise(light, channels); };
    }
    settings.direct.seed = settings.error.seed = settings.rest.seed = view.scene.seed;
    settings.error.samples = kPathsToMeasure;
    settings.lit_radius = lit_radius(view.scene.device.gel, reach);
  }
};

}  // namespace

DirectWork count_direct_work(const SceneView& view, const render::Camera& camera, std::span<const Truth> truths,
                             const std::optional<fem::ReliefAnswer>& relief) {
  TS_ASSERT(view.plan.direct_light && !truths.empty());
  const AskedLight asked(view, truths, &relief);
  DirectWork work;
  render::Scene direct = asked.rest;
  direct.interreflection = false;
  work.field = render::count_light_field(direct, asked.reach,
                                         render::light_field_settings(asked.rest, asked.reach, asked.settings));
  if (asked.rest.interreflection) {
    const Eigen::Vector2i size = render::size_of(camera);
    work.rest_paths =
        static_cast<double>(render::rest_light_samples(asked.rest, camera, asked.settings.rest)) * size.x() * size.y();
  }
  work.error_paths = 2.0 * asked.settings.error.pixels * asked.settings.error.samples;
  return work;
}

DirectLight::DirectLight(const SceneView& view, const render::Camera& camera, std::span<const Truth> truths,
                         const DirectLightSettings& wanted)
    : camera_(camera) {
  TS_ASSERT(view.plan.direct_light && !truths.empty() && !wanted.rays.empty());
  const SceneSpec& scene = view.scene;
  const bool forced = scene.effects.direct_light == Switch::on;
  AskedLight asked(view, truths, wanted.relief);
  render::DirectChoiceSettings& settings = asked.settings;
  settings.direct.edge_side = wanted.edge_side;
  settings.guides = wanted.guides;
  if (wanted.field_accuracy > 0.0) settings.field_accuracy = wanted.field_accuracy;
  settings.samples.assign(wanted.rays.begin(), wanted.rays.end());
  settings.whatever = forced;
  render::DirectChoice chosen = render::choose_direct(asked.rest, asked.pressed, camera, asked.reach, settings);
  if (chosen.error.pixels > 0) choice_.error = chosen.error;
  if (!chosen.renderer) {
    if (forced) fail_at(scene.where, "effects.direct_light: on, but {}", chosen.reason);
    choice_.reason = choice_.error ? with_figures("paths", chosen) + beside_the_limit(light_limits(scene), chosen)
                                   : fmt::format("paths: {}", chosen.reason);
    return;
  }
  choice_.direct = true;
  const int rays = settings.direct.samples = chosen.samples;
  choice_.reason =
      with_figures(rays == 1 ? "direct light" : fmt::format("direct light of {} rays a pixel", rays), chosen);
  if (chosen.paths_noise) choice_.reason += beside_the_limit(light_limits(scene), chosen);  // nothing was within it
  settings_ = settings.direct;
  rest_ = asked.rest;
  rest_.interreflection = false;
  field_ = std::move(chosen.field);
  bounced_ = chosen.bounced;
  idle_.push_back(std::move(chosen.renderer));
}

DirectLight::DirectLight(const SceneView& view, const render::Camera& camera, const fem::PressState& still,
                         FoundLight found, int edge_side)
    : choice_(std::move(found.choice)), camera_(camera), field_(std::move(found.field)), bounced_(found.bounced) {
  if (!choice_.direct) return;
  settings_.samples = found.rays;
  settings_.edge_side = edge_side;
  settings_.seed = view.scene.seed;
  rest_ = for_direct_light(view.seen(still, {}));
  field_.fixture = rest_;
  field_.fixture.surfaces.clear();
  field_.fixture.balls.clear();
  field_.walls = render::walls_round_sheet(rest_, field_.reach);
  rest_.interreflection = false;
  const Eigen::Index bands = rest_.environment.size();
  const auto lamps = static_cast<int>(rest_.lamps.size());
  const Eigen::Vector2i size = render::size_of(camera);
  if (field_.layer < 0 || field_.layer > static_cast<int>(rest_.faces.size()) ||
      std::any_of(field_.lamp_of.begin(), field_.lamp_of.end(), [&](int lamp) { return lamp < 0 || lamp >= lamps; }) ||
      std::any_of(field_.intensity.begin(), field_.intensity.end(), [&](const auto& i) { return i.size() != bands; }) ||
      (!bounced_.empty() && (bounced_.cols != size.x() || bounced_.rows != size.y() || bounced_.channels() != bands))) {
    fail("the light that was found before is another scene's or camera's");
  }
}

FoundLight DirectLight::found() const {
  FoundLight found{choice_, settings_.samples, field_, bounced_};
  found.field.fixture = {};
  return found;
}

std::unique_ptr<render::DirectRenderer> DirectLight::borrow() const {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      auto renderer = std::move(idle_.back());
      idle_.pop_back();
      return renderer;
    }
  }
  auto renderer = std::make_unique<render::DirectRenderer>(field_, camera_, rest_, settings_);
  renderer->set_bounced_light(bounced_, rest_);
  return renderer;
}

bool DirectLight::is_within_reach(const render::Scene& direct) const {
  const Eigen::AlignedBox3d reach(field_.reach.min().array() - kRounding_mm, field_.reach.max().array() + kRounding_mm);
  return reach.contains(lit_box(direct));
}

template <typename Work>
auto DirectLight::with_renderer(const Work& work) const {
  // Isolated: a thread that waits in here for its own tasks would else begin another picture, and with it a renderer.
  return tbb::this_task_arena::isolate([&] {
    auto renderer = borrow();
    auto made = work(*renderer);
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(renderer));
    return made;
  });
}

std::optional<render::DirectImage> DirectLight::render(render::Scene scene, const render::SamplePart& part) const {
  TS_ASSERT(choice_.direct);
  const render::Scene direct = for_direct_light(std::move(scene));
  if (!is_within_reach(direct)) return std::nullopt;
  return with_renderer([&](render::DirectRenderer& renderer) { return renderer.render(direct, part); });
}

render::SamplePart DirectLight::part_of(std::size_t moment, double together) const {
  const int step = std::clamp(static_cast<int>(together), 1, settings_.samples);
  return {static_cast<int>(moment % static_cast<std::size_t>(step)), step};
}

std::optional<render::SheetPoints> DirectLight::points(const render::Scene& scene) const {
  TS_ASSERT(has_points());
  const render::Scene direct = for_direct_light(scene);
  if (!is_within_reach(direct)) return std::nullopt;
  return with_renderer([&](render::DirectRenderer& renderer) { return renderer.sheet_points(direct); });
}

void DirectLight::picture_of(std::vector<float>& radiance, cv::Mat& irradiance) const {
  TS_ASSERT(has_points());
  with_renderer([&](render::DirectRenderer& renderer) {
    renderer.picture_of(radiance, irradiance);
    return true;
  });
}

}  // namespace touchstone::sim
