#include "bench/direct_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "bench/gelsight_scene.h"
#include "bench/light_scenes.h"
#include "bench/stopwatch.h"
#include "render/direct/direct_error.h"
#include "render/direct/direct_renderer.h"
#include "render/direct/rest_light.h"

namespace touchstone::bench {
namespace {

using render::DirectError;
using render::DirectRenderer;
using render::Scene;

struct Time {
  double seconds = INFINITY;
  double processor_seconds = INFINITY;
};

/// Least of some frames that alternate between two shapes, checks, tree and all.
Time frame_time(DirectRenderer& renderer, const Scene& one, const Scene& other, int frames) {
  Time least;
  for (int frame = 0; frame < frames; ++frame) {
    const Stopwatch clock;
    const ProcessorStopwatch processors;
    renderer.render(frame % 2 == 0 ? other : one);
    least.seconds = std::min(least.seconds, clock.seconds());
    least.processor_seconds = std::min(least.processor_seconds, processors.seconds());
  }
  return least;
}

std::string percent(const DirectError& error) {
  return fmt::format("{:.2f} +- {:.2f}", 100 * error.rms, 100 * error.rms_error);
}

std::string milliseconds(double seconds) {
  return fmt::format("{:.2f}", 1e3 * seconds);
}

}  // namespace

ResultTable gelsight_frames_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-gelsight";
  table.title = "A gelsight-like membrane, 320 x 240, four lamp groups of three";
  table.columns = {"membrane",        "pressed by",   "ms, no shadows", "processor ms, no shadows",
                   "ms, shadows",     "processor ms", "direct, % RMS",  "direct against all light, %",
                   "with rest light", "its mean, %"};
  const render::LensCamera camera = gelsight_camera(320, 240);
  render::DirectErrorSettings judge;
  judge.samples = options.quick ? 64 : 512;
  judge.pixels = options.quick ? 300 : 1200;
  const render::Material membranes[2] = {render::Lambertian{render::flat_spectrum(3, 0.6)},
                                         render::RoughConductor{render::flat_spectrum(3, 0.6), 0.5}};
  for (int metal = 0; metal < 2; ++metal) {
    const render::Material& membrane = membranes[metal];
    const Scene rest = gelsight_scene(Pressed::kNothing, 50000, membrane, false);
    const render::LightField field = render::make_light_field(rest, gelsight_reach());
    render::DirectSettings bare;
    bare.shadows = false;
    DirectRenderer shadowless(field, camera, rest, bare);
    DirectRenderer renderer(field, camera, rest);
    render::RestLightSettings light;
    light.samples = options.quick ? 16 : 64;
    const cv::Mat bounced = measure_rest_light(renderer, rest, camera, light);
    for (const auto& [pressed, name] : {std::pair{Pressed::kNothing, "nothing"}, std::pair{Pressed::kBall, "ball"},
                                        std::pair{Pressed::kCoin, "coin"}}) {
      const Scene scene = gelsight_scene(pressed, 50000, membrane, false);
      const Scene moved = gelsight_scene(pressed, 50000, membrane, false, 0.05);
      Scene all = scene;
      all.interreflection = true;
      const int frames = options.quick ? 10 : 40;
      const Time without = frame_time(shadowless, scene, moved, frames);
      const Time with = frame_time(renderer, scene, moved, frames);
      const cv::Mat direct = renderer.render(scene).irradiance;
      renderer.set_bounced_light(bounced);
      const cv::Mat carried = renderer.render(scene).irradiance;
      renderer.set_bounced_light({});
      const DirectError left = measure_direct_error(carried, all, camera, judge);
      table.rows.push_back({metal != 0 ? "metal flake" : "matt", name, milliseconds(without.seconds),
                            milliseconds(without.processor_seconds), milliseconds(with.seconds),
                            milliseconds(with.processor_seconds),
                            percent(measure_direct_error(direct, scene, camera, judge)),
                            percent(measure_direct_error(direct, all, camera, judge)), percent(left),
                            fmt::format("{:+.2f}", 100 * left.mean)});
    }
  }
  table.remarks = {
      fmt::format("50k triangles; least of {} frames. Errors on {} pixels against path tracing of {} samples twice, "
                  "whose noise is not in them.",
                  options.quick ? 10 : 40, judge.pixels, judge.samples),
      "\"Rest light\" is the bounced light of the membrane at rest, carried along.",
      "The public Taxim simulator's frame took some 30 ms without and 200 ms with shadows for as many pixels on such a "
      "machine (a quarter of what was measured for 640 x 480); the goal is a tenth."};
  return table;
}

ResultTable hole_blur_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-hole-blur";
  table.title = "The hole's blur: rays across it, time and error";
  table.columns = {"pixels", "rays across", "camera rays", "ms", "processor ms", "RMS error, %"};
  render::DirectErrorSettings judge;
  judge.samples = options.quick ? 64 : 512;
  judge.pixels = options.quick ? 300 : 1200;
  for (const int width : {320, 640}) {
    const int height = width / 4 * 3;
    const Scene scene = bench_scene(50000, 8, 3, false);
    const Scene moved = bench_scene(50000, 8, 3, false, 0.05);
    const render::PinholeCamera camera = bench_camera(width, height);
    const render::LightField field = render::make_light_field(scene, bench_reach());
    const auto row = [&](const std::string& name, const render::DirectSettings& settings) {
      DirectRenderer renderer(field, camera, scene, settings);
      const Time time = frame_time(renderer, scene, moved, options.quick ? 10 : 40);
      const render::DirectImage image = renderer.render(scene);
      table.rows.push_back({fmt::format("{} x {}", width, height), name, fmt::format("{}", image.primary),
                            milliseconds(time.seconds), milliseconds(time.processor_seconds),
                            percent(measure_direct_error(image.irradiance, scene, camera, judge))});
    };
    render::DirectSettings settings;
    settings.blur = false;
    row("not spread", settings);
    settings.blur = true;
    for (double rays : {1.0, 3.0, 6.0, 12.0}) {
      settings.rays_across_blur = rays;
      row(fmt::format("{:.0f}", rays), settings);
    }
  }
  table.remarks = {
      "8 lamps, shadows, 50k triangles that move. Rays are cast for squares of 1, 2, 4 or 8 pixels, so that "
      "at least so many stand across the narrowest blur of the picture, or one for each pixel."};
  return table;
}

}  // namespace touchstone::bench
