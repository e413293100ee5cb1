#include "bench/light_sections.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "bench/light_scenes.h"
#include "bench/stopwatch.h"
#include "core/error.h"
#include "render/direct/direct_renderer.h"
#include "render/paths/path_integrator.h"
#include "render/paths/path_tracer.h"
#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_camera.h"

namespace touchstone::bench {
namespace {

using render::DirectRenderer;
using render::RenderSettings;
using render::Tracer;

/// Least of `runs` runs: what others on the machine disturb least.
double least_seconds(int runs, const std::function<void()>& work) {
  double least = INFINITY;
  for (int run = 0; run < runs; ++run) {
    const Stopwatch clock;
    work();
    least = std::min(least, clock.seconds());
  }
  return least;
}

std::size_t threads() {
  return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
}

RenderSettings paths(int count) {
  RenderSettings settings;
  settings.seed = 5;
  settings.min_samples = settings.max_samples = count;
  return settings;
}

/// Relative root mean square difference, all bands, where `mask` isn't zero.
double relative_rms(const cv::Mat& image, const cv::Mat& reference, const cv::Mat& mask = {}) {
  double wrong = 0.0;
  double whole = 0.0;
  const int channels = image.channels();
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      if (!mask.empty() && mask.at<unsigned char>(row, column) == 0) continue;
      for (int c = 0; c < channels; ++c) {
        const double a = image.ptr<float>(row)[channels * column + c];
        const double b = reference.ptr<float>(row)[channels * column + c];
        wrong += (a - b) * (a - b);
        whole += b * b;
      }
    }
  }
  return whole > 0.0 ? std::sqrt(wrong / whole) : 0.0;
}

/// Records the rays of a frame as Tracer::render draws it, pixel by pixel in the same tiles.
std::vector<render::RecordedRay> rays_of(const render::PreparedScene<3>& scene, const render::PinholeCamera& camera,
                                         const RenderSettings& settings) {
  std::vector<render::RecordedRay> rays;
  constexpr int kTile = 16;
  const render::PathIntegrator<3> integrator(scene, settings.max_depth, scene.interreflection);
  render::RayCounts counts;
  scene.rays.record(&rays);
  for (int top = 0; top < camera.height; top += kTile) {
    for (int left = 0; left < camera.width; left += kTile) {
      for (int row = top; row < std::min(top + kTile, camera.height); ++row) {
        for (int column = left; column < std::min(left + kTile, camera.width); ++column) {
          for (int sample = 0; sample < settings.min_samples; ++sample) {
            render::SampleSequence numbers(settings.seed, static_cast<std::uint64_t>(row) * camera.width + column,
                                           static_cast<std::uint32_t>(sample));
            const auto [px, py] = numbers.next_pair();
            const auto [hu, hv] = numbers.next_pair();
            if (const auto ray = render::pinhole_ray(camera, column + px, row + py, hu, hv)) {
              integrator.trace(camera.gel_from_camera * ray->origin, camera.gel_from_camera.turn(ray->direction),
                               numbers, counts);
            }
          }
        }
      }
    }
  }
  scene.rays.record(nullptr);
  return rays;
}

cv::Mat sparse_mask(const render::PinholeCamera& camera, int stride) {
  cv::Mat mask = cv::Mat::zeros(camera.height, camera.width, CV_8UC1);
  for (int row = stride / 2; row < camera.height; row += stride) {
    for (int column = stride / 2; column < camera.width; column += stride) mask.at<unsigned char>(row, column) = 255;
  }
  return mask;
}

struct FrameTime {
  double seconds = 0.0;
  double processor_seconds = INFINITY;
  render::DirectImage image;  // of the scene that isn't shifted
};

/// A frame of a membrane that moves to and fro, checks, tree and all. Making the scene isn't counted.
FrameTime direct_frame(int triangles, int lamps, int bands, int width, int height, int frames, bool shadows = true) {
  const render::Scene one = bench_scene(triangles, lamps, bands, false);
  const render::Scene other = bench_scene(triangles, lamps, bands, false, 0.05);
  const render::LightField field = render::make_light_field(one, bench_reach());
  render::DirectSettings settings;
  settings.shadows = shadows;
  DirectRenderer renderer(field, bench_camera(width, height), one, settings);
  FrameTime result;
  result.seconds = INFINITY;
  // Runs of ten frames: the least mean, so that no single lucky frame counts.
  for (int run = 0; run < std::max(1, frames / 10); ++run) {
    const ProcessorStopwatch processors;
    const double mean = least_seconds(1,
                                      [&] {
                                        for (int k = 0; k < 10; ++k) renderer.render(k % 2 == 0 ? other : one);
                                      }) /
                        10;
    result.seconds = std::min(result.seconds, mean);
    result.processor_seconds = std::min(result.processor_seconds, processors.seconds() / 10);
  }
  result.image = renderer.render(one);
  return result;
}

}  // namespace

ResultTable bare_rays_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-rays";
  table.title = "Path tracer against bare Embree on the very same rays";
  table.columns = {"membrane",          "paths",          "legs",         "Embree rays", "tracer, s",
                   "same rays bare, s", "Mrays/s traced", "Mrays/s bare", "ratio",       "ratio a leg"};
  struct Case {
    const char* name;
    bool interreflection;
    int triangles;
  };
  const RenderSettings settings = paths(options.quick ? 4 : 16);
  for (const Case& one : {Case{"direct light, 50k", false, 50000}, Case{"interreflection, 50k", true, 50000},
                          Case{"interreflection, 200k", true, 200000}}) {
    const render::Scene scene = bench_scene(one.triangles, 8, 3, one.interreflection);
    const render::PinholeCamera camera = bench_camera(160, 120);
    const Tracer tracer(scene);
    render::PreparedScene<3> prepared(scene);
    render::weigh_lamps(prepared);
    const std::vector<render::RecordedRay> rays = rays_of(prepared, camera, settings);
    double traced = INFINITY;
    double bare = INFINITY;
    render::RayCounts counts;
    std::uint64_t met = 0;
    for (int run = 0; run < (options.quick ? 3 : 5); ++run) {  // by turns, so that a busy spell meets both
      traced = std::min(traced, least_seconds(1, [&] { counts = tracer.render(camera, settings).counts; }));
      bare = std::min(bare, least_seconds(1, [&] {
                        met = tbb::parallel_reduce(
                            tbb::blocked_range<std::size_t>(0, rays.size(), 4096), std::uint64_t{0},
                            [&](const tbb::blocked_range<std::size_t>& part, std::uint64_t sum) {
                              return sum + prepared.rays.trace_bare({rays.data() + part.begin(), part.size()});
                            },
                            std::plus<>());
                      }));
    }
    if (met == 0) fail("bench: the rays of \"{}\" meet nothing", one.name);
    const double million = static_cast<double>(rays.size()) / 1e6;
    // A connection to a lamp runs through gel, glass and air.
    const std::uint64_t legs = counts.primary + counts.bounces + 3 * counts.connections;
    const double per_leg = traced / bare * static_cast<double>(rays.size()) / static_cast<double>(legs);
    table.rows.push_back({one.name, fmt::format("{}", counts.paths), fmt::format("{}", legs),
                          fmt::format("{}", rays.size()), fmt::format("{:.3f}", traced), fmt::format("{:.3f}", bare),
                          fmt::format("{:.1f}", million / traced), fmt::format("{:.1f}", million / bare),
                          fmt::format("{:.2f}", traced / bare), fmt::format("{:.2f}", per_leg)});
  }
  table.remarks = {
      fmt::format(
          "{} threads, 8 lamps, 160 x 120 pixels, single rays; each figure the least of several runs by turns. "
          "Legs that end at the flat faces ask Embree only where geometry may be in the way, so a path's legs "
          "through glass and air are the tracer's time but no rays here: \"ratio a leg\" is a leg's time, of whatever "
          "kind, against that of a bare ray.",
          threads()),
      "Goal: a ratio of at most 1.3."};
  return table;
}

ResultTable light_error_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-error";
  table.title = "Error against seconds";
  table.columns = {"renderer", "samples", "ms", "RMS error, %", "mean, %"};
  const render::PinholeCamera camera = options.quick ? bench_camera(48, 36) : bench_camera(96, 72);
  const int reference_samples = options.quick ? 1024 : 4096;
  plots::LinePlot plot;
  plot.title = "RMS error against seconds";
  plot.x_label = "seconds a frame";
  plot.y_label = "relative RMS error";
  const auto row = [&](const std::string& name, int count, double seconds, const cv::Mat& image,
                       const cv::Mat& reference) {
    const double error = relative_rms(image, reference);
    const cv::Scalar mean = cv::mean(image);
    table.rows.push_back({name, fmt::format("{}", count), fmt::format("{:.2f}", 1e3 * seconds),
                          fmt::format("{:.3f}", 100 * error),
                          fmt::format("{:+.3f}", 100 * (mean[0] / cv::mean(reference)[0] - 1.0))});
    return std::pair{seconds, error};
  };
  for (const bool interreflection : {true, false}) {
    const render::Scene scene = bench_scene(50000, 8, 3, interreflection);
    const Tracer tracer(scene);
    RenderSettings other = paths(reference_samples);
    other.seed = 77;
    const cv::Mat reference = tracer.render(camera, other).irradiance;
    plots::PlotCurve curve;
    curve.name = interreflection ? "path tracer, interreflection" : "path tracer, direct light";
    for (int count = 4; count <= 256; count *= 2) {
      cv::Mat image;
      const double seconds =
          least_seconds(options.quick ? 1 : 3, [&] { image = tracer.render(camera, paths(count)).irradiance; });
      curve.points.push_back(row(curve.name, count, seconds, image, reference));
    }
    plot.curves.push_back(curve);
    if (interreflection) continue;
    plots::PlotCurve direct;
    direct.name = "direct renderer";
    const render::LightField field = render::make_light_field(scene, bench_reach());
    for (int count : {1, 4, 16, 64}) {
      render::DirectSettings settings;
      settings.samples = count;
      settings.seed = 5;
      DirectRenderer renderer(field, camera, scene, settings);
      render::DirectImage image;
      const double seconds = least_seconds(options.quick ? 2 : 10, [&] { image = renderer.render(scene); });
      direct.points.push_back(row(direct.name, count, seconds, image.irradiance, reference));
    }
    plot.curves.push_back(direct);
  }
  table.plots = {plot};
  table.remarks = {
      fmt::format(
          "{} x {} pixels, 50k triangles, 8 lamps, against {} samples of another seed of the same kind of light; "
          "the reference's own noise is in the figures. \"Mean\" is the whole picture's.",
          camera.width, camera.height, reference_samples),
      "The direct renderer with one sample casts rays through the hole's middle and spreads the picture."};
  return table;
}

ResultTable direct_frames_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-frames";
  table.title = "Pictures a second of direct light";
  table.columns = {"pixels",       "lamps",       "shadows", "ms",           "frames/s",
                   "processor ms", "shadow rays", "spared",  "RMS error, %", "with a sharp hole, %"};
  double field_seconds = 0.0;
  double field_error = 0.0;
  for (const auto& [width, height] : {std::pair{320, 240}, std::pair{640, 480}}) {
    for (int lamps : {3, 8}) {
      const render::Scene scene = bench_scene(50000, lamps, 3, false);
      const render::PinholeCamera camera = bench_camera(width, height);
      const cv::Mat mask = sparse_mask(camera, width / 40);
      const cv::Mat reference = Tracer(scene).render(camera, paths(options.quick ? 512 : 4096), mask).irradiance;
      render::PinholeCamera sharp = camera;  // no blur but the pixel's own
      sharp.hole_diameter_um = 1.0;
      sharp.foil_thickness_um = 0.0;
      const cv::Mat sharp_reference = Tracer(scene).render(sharp, paths(options.quick ? 512 : 4096), mask).irradiance;
      render::LightField field;
      field_seconds = least_seconds(1, [&] { field = render::make_light_field(scene, bench_reach()); });
      field_error = field.error;
      for (bool shadows : {true, false}) {
        render::DirectSettings settings;
        settings.shadows = shadows;
        const cv::Mat sharp_image = DirectRenderer(field, sharp, scene, settings).render(scene).irradiance;
        const FrameTime frame = direct_frame(50000, lamps, 3, width, height, options.quick ? 20 : 60, shadows);
        table.rows.push_back({fmt::format("{} x {}", width, height), fmt::format("{}", lamps), shadows ? "yes" : "no",
                              fmt::format("{:.2f}", 1e3 * frame.seconds), fmt::format("{:.0f}", 1.0 / frame.seconds),
                              fmt::format("{:.1f}", 1e3 * frame.processor_seconds),
                              fmt::format("{}", frame.image.shadow_rays), fmt::format("{}", frame.image.shadow_spared),
                              fmt::format("{:.2f}", 100 * relative_rms(frame.image.irradiance, reference, mask)),
                              fmt::format("{:.2f}", 100 * relative_rms(sharp_image, sharp_reference, mask))});
      }
    }
  }
  table.remarks = {
      fmt::format("{} threads; 50k triangles move in every frame, their tree is fitted anew; best mean of ten frames. "
                  "Errors on {} pixels against the path tracer's direct light of {} samples, pixel, hole and lens "
                  "sampled.",
                  threads(), 40 * 30, options.quick ? 512 : 4096),
      fmt::format("The light field is set up once a fixture: {:.2f} s with 8 lamps, estimated error {:.2f} %.",
                  field_seconds, 100 * field_error),
      "\"Processor ms\" is summed over the threads: what others on the machine take doesn't count in it.",
      "Goals: 100 frames/s at 320 x 240, 40 at 640 x 480, with shadows, at 1.5 % RMS."};
  return table;
}

ResultTable light_growth_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-growth";
  table.title = "Growth with triangles, pixels and bands";
  table.columns = {"triangles", "pixels", "bands", "direct light, ms", "tracer set-up, ms", "16 paths a pixel, s"};
  struct Case {
    int triangles, width, height, bands;
  };
  const std::vector<Case> cases = {{50000, 320, 240, 3}, {200000, 320, 240, 3}, {1000000, 320, 240, 3},
                                   {50000, 160, 120, 3}, {50000, 640, 480, 3},  {50000, 320, 240, 1},
                                   {50000, 320, 240, 16}};
  for (const Case& one : cases) {
    const FrameTime direct = direct_frame(one.triangles, 8, one.bands, one.width, one.height, options.quick ? 10 : 40);
    std::string set_up = "-";
    std::string traced = "-";
    const render::PinholeCamera camera = bench_camera(one.width, one.height);
    // In the quick form a 16th of the pixels is traced.
    const cv::Mat mask = options.quick ? sparse_mask(camera, 4) : cv::Mat();
    try {
      const render::Scene scene = bench_scene(one.triangles, 8, one.bands, true);
      std::unique_ptr<Tracer> tracer;
      set_up = fmt::format("{:.1f}", 1e3 * least_seconds(1, [&] { tracer = std::make_unique<Tracer>(scene); }));
      const double seconds = least_seconds(1, [&] { tracer->render(camera, paths(16), mask); });
      traced = fmt::format("{:.2f}", seconds * (options.quick ? 16 : 1));
    } catch (const Error&) {  // a number of bands that the path tracer doesn't carry
    }
    table.rows.push_back({fmt::format("{}", one.triangles), fmt::format("{} x {}", one.width, one.height),
                          fmt::format("{}", one.bands), fmt::format("{:.2f}", 1e3 * direct.seconds), set_up, traced});
  }
  table.remarks = {"8 lamps. The path tracer's column is with interreflection, depth 8" +
                       std::string(options.quick ? ", scaled up from a 16th of the pixels." : "."),
                   "A dash: the path tracer doesn't carry that number of bands."};
  return table;
}

ResultTable device_frames_table(const LightOptions& options) {
  ResultTable table;
  table.name = "light-devices";
  table.title = "A device's pictures at its default accuracy";
  table.columns = {"device", "pixels", "picture", "s", "frames/s", "Mpaths", "Mpaths/s"};
  sim::SceneSpec scene = sim::read_scene(std::string(TOUCHSTONE_SOURCE_DIR) + "/scenes/vhs/verification.yaml");
  scene.motion.keys.resize(1);
  const sim::Plan plan = sim::make_plan(scene);
  const auto gel = sim::set_up_gel(scene.device, options.cache);
  const std::vector<sim::Truth> truths = sim::play_motion(scene, plan, *gel);
  std::unique_ptr<sim::VirtualCamera> camera;
  const double first =
      least_seconds(1, [&] { camera = std::make_unique<sim::VirtualCamera>(scene, plan, *gel, truths.front()); });
  const std::string pixels = fmt::format("{} x {}", scene.device.camera->width, scene.device.camera->height);
  table.rows.push_back({"vhs", pixels, "first of a sequence, better than the others", fmt::format("{:.2f}", first),
                        fmt::format("{:.2f}", 1.0 / first), "-", "-"});
  const auto row = [&](const char* name, const std::function<sim::Capture()>& take) {
    sim::Capture capture;
    const double seconds = least_seconds(options.quick ? 1 : 3, [&] { capture = take(); });
    const double million = static_cast<double>(capture.paths_traced) / 1e6;
    table.rows.push_back({"vhs", pixels, name, fmt::format("{:.2f}", seconds), fmt::format("{:.2f}", 1.0 / seconds),
                          fmt::format("{:.2f}", million), fmt::format("{:.2f}", million / seconds)});
  };
  row("what moved since the first", [&] { return camera->capture(truths.back()); });
  if (!options.quick) row("whole", [&] { return camera->capture_whole(truths.back()); });
  table.remarks = {fmt::format("{} threads; the press of scenes/vhs/verification.yaml.", threads())};
  return table;
}

}  // namespace touchstone::bench
