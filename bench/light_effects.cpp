// What each effect costs when it's on.

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "bench/light_scenes.h"
#include "bench/light_sections.h"
#include "bench/stopwatch.h"
#include "render/cameras/rolling_shutter.h"
#include "render/events/event_pixels.h"
#include "render/imager/imager.h"
#include "render/paths/path_tracer.h"

namespace touchstone::bench {
namespace {

using render::RenderedImage;
using render::Scene;
using render::Tracer;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

/// Direct light on the matt membrane and the beads in air.
Scene plain_scene(int bands = 3, double shift = 0.0) {
  Scene scene = bench_scene(50000, 8, bands, false, shift);
  scene.media = {render::Medium{}};
  scene.faces.clear();
  return scene;
}

/// Behind a point.
render::PinholeCamera plain_camera() {
  render::PinholeCamera camera = bench_camera(kWidth, kHeight);
  camera.hole_diameter_um = 1.0;
  camera.foil_thickness_um = 0.0;
  return camera;
}

/// The same picture through a lens of 2.5 mm, focused on the membrane.
render::LensCamera lens_camera() {
  const render::PinholeCamera hole = plain_camera();
  constexpr double kFocalLength = 4.0;  // mm: sharp at 20 mm with the sensor 5 mm behind it
  constexpr double kFocus = 20.0;
  render::LensCamera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.matrix = render::matrix_of_lens(kFocalLength, kFocus, hole.pixel_pitch_um, kWidth, kHeight);
  camera.pixel_pitch_um = hole.pixel_pitch_um;
  camera.aperture_mm = 2.5;
  camera.focus_distance_mm = kFocus;
  camera.gel_from_camera = hole.gel_from_camera;
  return camera;
}

Scene with_print(Scene scene) {
  render::Surface& membrane = scene.surfaces.front();
  render::Print print;
  for (const Eigen::Vector3d& x : membrane.mesh.vertices) print.material_mm.push_back(x.head<2>());
  print.inks = {render::flat_spectrum(3, 0.05)};
  for (int j = -9; j <= 9; ++j) {
    for (int i = -9; i <= 9; ++i) print.marks.push_back({{i, j}, 0.3, 0});
  }
  membrane.print = print;
  return scene;
}

/// A foil in the way of what the camera sees and of the lamps' light.
Scene with_film(Scene scene) {
  TriangleMesh sheet;
  sheet.vertices = {{-60, -60, -4}, {60, -60, -4}, {60, 60, -4}, {-60, 60, -4}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.surfaces.push_back({sheet, render::ThinFilm{render::flat_spectrum(3, 0.7), 1.5, true}});
  return scene;
}

Scene with_metal(Scene scene) {
  scene.surfaces.front().material = render::RoughConductor{render::flat_spectrum(3, 0.6), 0.3};
  return scene;
}

Scene with_slab(bool interreflection) {
  return bench_scene(50000, 8, 3, interreflection);
}

/// The gel ends just behind the membrane: paths would wander about for long in an endless one.
Scene with_milky_gel(double scattering_per_mm) {
  Scene scene = with_slab(true);
  scene.media.back().scattering = render::flat_spectrum(3, scattering_per_mm);
  scene.faces.push_back({0.1, 2, 0});
  return scene;
}

Scene with_interreflection(Scene scene) {
  scene.interreflection = true;
  return scene;
}

/// What a frame with the effect on does; returns its rays.
using Frame = std::function<render::RayCounts()>;

/// Takes the picture of a scene, then `after` does more with it.
Frame picture(
    const Scene& scene, const render::Camera& camera, int samples,
    const std::function<void(const cv::Mat&)>& after = [](const cv::Mat&) {}) {
  const auto tracer = std::make_shared<Tracer>(scene);
  return [=] {
    render::RenderSettings settings;
    settings.seed = 5;
    settings.min_samples = settings.max_samples = samples;
    const RenderedImage image = tracer->render(camera, settings);
    after(image.irradiance);
    return image.counts;
  };
}

/// The membrane at four instants, a quarter of the paths at each.
Frame blurred_picture(int samples) {
  constexpr int kInstants = 4;
  const auto instants = std::make_shared<std::vector<render::TimedIrradiance>>();
  std::vector<Frame> frames;
  for (int k = 0; k < kInstants; ++k) {
    frames.push_back(
        picture(plain_scene(3, 0.02 * k), plain_camera(), samples / kInstants, [=](const cv::Mat& irradiance) {
          instants->push_back({1e-3 * k, irradiance});
        }));
  }
  return [=] {
    instants->clear();
    render::RayCounts counts;
    for (const Frame& frame : frames) counts += frame();
    render::rolling_exposure(*instants, {0.0, 1e-3 * (kInstants - 1), 0.0});
    return counts;
  };
}

Frame noisy_picture(int samples) {
  const render::Imager imager = render::imx273_skipping(12, 1e-3);
  const render::FixedPattern pattern = render::fixed_pattern(imager, {kWidth, kHeight}, 1);
  return picture(plain_scene(), plain_camera(), samples,
                 [=](const cv::Mat& irradiance) { render::expose(irradiance, imager, pattern, 1, 0); });
}

/// Events between this frame and the one before.
Frame watched_picture(int samples) {
  struct Watch {
    render::EventPixels pixels;
    std::vector<Event> events;
    std::int64_t t_us = 0;
    bool brighter = false;
  };
  const auto watch = std::make_shared<Watch>(
      Watch{render::EventPixels(render::davis240c(1.0), {kWidth, kHeight}, 1, 2), {}, 0, false});
  return picture(plain_scene(), plain_camera(), samples, [=](const cv::Mat& irradiance) {
    cv::Mat light;
    cv::extractChannel(irradiance, light, 0);
    watch->brighter = !watch->brighter;
    light *= watch->brighter ? 1.05 : 1.0;  // a step below the thresholds: the usual frame of a dense sequence
    watch->events.clear();
    watch->pixels.advance(light, watch->t_us += 1000, watch->events);
  });
}

struct Cost {
  render::RayCounts counts;
  double seconds = INFINITY;        // of all processors
  double plain_seconds = INFINITY;  // likewise, of the plain picture taken by turns with it
};

Cost cost_of(const Frame& frame, const Frame& plain, int turns) {
  Cost cost;
  for (int turn = 0; turn < turns; ++turn) {
    const ProcessorStopwatch first;
    plain();
    cost.plain_seconds = std::min(cost.plain_seconds, first.seconds());
    const ProcessorStopwatch second;
    cost.counts = frame();
    cost.seconds = std::min(cost.seconds, second.seconds());
  }
  return cost;
}

}  // namespace

ResultTable light_effects_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-effects";
  table.title = "What each effect costs when it's on";
  table.columns = {
      "effect",       "legs to the first hit a path", "connections a path", "legs after it a path", "processor s",
      "against plain"};
  const int samples = options.quick ? 4 : 16;
  const int turns = options.quick ? 2 : 5;
  const Scene scene = plain_scene();
  const render::PinholeCamera camera = plain_camera();
  const Frame plain = picture(scene, camera, samples);
  const auto traced = [&](const Scene& other) { return [&, other] { return picture(other, camera, samples); }; };
  // Made when its turn comes, so that one scene is held at a time.
  const std::vector<std::pair<std::string, std::function<Frame()>>> effects = {
      {"none (plain)", [&] { return plain; }},
      {"interreflection", traced(with_interreflection(scene))},
      {"refraction: plate and gel, direct light", traced(with_slab(false))},
      {"refraction and interreflection", traced(with_slab(true))},
      {"the same, the gel scatters (0.05 per mm)", traced(with_milky_gel(0.05))},
      {"print: 361 dots", traced(with_print(scene))},
      {"thin film with faces", traced(with_film(scene))},
      {"metal membrane", traced(with_metal(scene))},
      {"hole of 100 um in foil of 50 um", [&] { return picture(scene, bench_camera(kWidth, kHeight), samples); }},
      {"lens", [&] { return picture(scene, lens_camera(), samples); }},
      {"motion blur: 4 instants, paths shared out", [&] { return blurred_picture(samples); }},
      {"sensor noise", [&] { return noisy_picture(samples); }},
      {"events", [&] { return watched_picture(samples); }},
      {"1 band", traced(plain_scene(1))},
      {"8 bands", traced(plain_scene(8))},
      {"16 bands", traced(plain_scene(16))}};
  for (const auto& [name, make] : effects) {
    const Cost cost = cost_of(make(), plain, turns);
    const auto per_path = [&](std::uint64_t count) {
      return fmt::format("{:.2f}", static_cast<double>(count) / static_cast<double>(cost.counts.paths));
    };
    table.rows.push_back({name, per_path(cost.counts.primary), per_path(cost.counts.connections),
                          per_path(cost.counts.bounces), fmt::format("{:.3f}", cost.seconds),
                          fmt::format("{:.2f}", cost.seconds / cost.plain_seconds)});
  }
  table.remarks = {
      fmt::format(
          "Plain: direct light of 8 lamps on a matt membrane of 50k triangles and nine beads in air, a point "
          "camera of {} x {} pixels, 3 bands, {} paths a pixel. Each effect alone, but where it says otherwise; "
          "making the tracer isn't counted.",
          kWidth, kHeight, samples),
      "Processor seconds are summed over the threads, the least of several frames by turns with the plain one.",
      "What an effect adds in noise isn't in here: hole and lens need more paths for the same error."};
  return table;
}

}  // namespace touchstone::bench
