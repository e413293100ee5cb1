#include <spdlog/spdlog.h>

#include <memory>
#include <opencv2/core.hpp>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/jobs/scene_plan.h"
#include "datasets/sets/run_identity.h"
#include "datasets/sets/sample_source.h"
#include "sensors/events/event_file.h"
#include "sim/files/gltf_writer.h"
#include "sim/files/image_file.h"
#include "sim/plan/plan.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/touch_doubts.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/event_picture.h"
#include "sim/sensor/virtual_camera.h"
#include "sim/view/frame_geometry.h"

namespace touchstone::apps {
namespace {

struct RenderOptions {
  std::filesystem::path scene;
  std::filesystem::path out;
  std::filesystem::path gltf;
  std::filesystem::path truth;
  std::filesystem::path events;
  std::filesystem::path events_picture;
  int frame = -1;
  bool ideal = false;
  bool exr = false;
};

/// Share of a picture's pixels at the largest number in any channel.
double saturated_share(const cv::Mat& picture) {
  if (picture.empty()) return 0.0;
  cv::Mat channels = picture.reshape(1, static_cast<int>(picture.total()));
  cv::Mat brightest;
  cv::reduce(channels, brightest, 1, cv::REDUCE_MAX);
  return cv::countNonZero(brightest == 255) / static_cast<double>(picture.total());
}

void require_ending(const std::filesystem::path& file, const char* ending, const char* whose) {
  if (file.empty()) return;
  if (file.extension() != ending) fail("{}: {} name must end in {}", file.string(), whose, ending);
  require_writable_place(file);
}

/// Writes the events of the whole scene, and a picture of those of the last 20 ms before the frame's begin.
sim::EventStreamReport write_events(const RenderOptions& options, const sim::SceneSpec& scene, const sim::Plan& plan,
                                    const fem::Compliance& gel, std::int64_t frame_us, const GlobalOptions& global,
                                    const Progress& progress) {
  constexpr std::int64_t kShown_us = 20'000;
  const cv::Size size(scene.device.camera->width, scene.device.camera->height);
  std::vector<Event> shown;
  std::unique_ptr<sensors::EventWriter> writer;
  const auto sink = [&](std::span<const Event> events) {
    if (writer) writer->append(events);
    for (const Event& event : events) {
      if (event.t_us > frame_us - kShown_us && event.t_us <= frame_us) shown.push_back(event);
    }
  };
  const auto watch = [&] {
    return datasets::simulator(global.cache).watch_events(scene, plan, gel, scene.seed, sink, progress);
  };
  sim::EventStreamReport report;
  if (options.events.empty()) {
    report = watch();
  } else {
    write_whole_file(options.events, [&](const std::filesystem::path& temporary) {
      writer = std::make_unique<sensors::EventWriter>(temporary, size, datasets::program_name());
      report = watch();
      writer->close();
    });
  }
  if (!options.events_picture.empty()) sim::write_png(options.events_picture, sim::event_picture(shown, size));
  return report;
}

void render(const RenderOptions& options, const GlobalOptions& global) {
  const bool picture = !options.out.empty();
  const bool truth = !options.truth.empty();
  require_ending(options.out, ".png", "the picture's");
  require_ending(options.gltf, ".glb", "the geometry's");
  require_ending(options.truth, ".exr", "the truth's");
  if (!options.events.empty()) {
    sensors::event_format_of_name(options.events);
    require_writable_place(options.events);
  }
  require_ending(options.events_picture, ".png", "the events' picture's");
  const bool events = !options.events.empty() || !options.events_picture.empty();
  if (!picture && !truth && !events && options.gltf.empty()) {
    fail("nothing to make: give --out, --truth, --gltf or --events");
  }
  if (options.exr && !picture) fail("--exr: is written beside the picture; give --out");
  sim::SceneSpec scene = sim::read_scene(options.scene);
  const SourceLocation outputs = scene.outputs.where;
  scene.outputs = {.frames = picture && !options.ideal,
                   .ideal = picture && options.ideal,
                   .radiance = options.exr,
                   .where = outputs};
  scene.outputs.depth = scene.outputs.normals = scene.outputs.ids = truth;
  scene.outputs.contact = scene.outputs.flow = truth;
  scene.outputs.events = events;
  const int frames = scene.motion.frame_count();
  const int frame = options.frame < 0 ? frames - 1 : options.frame;
  if (frame >= frames) {
    fail("--frame {}: the scene {} has frames 0 to {}", frame, options.scene.string(), frames - 1);
  }
  sim::Plan plan;
  {
    ProgressBar bar(global.quiet);
    plan = datasets::plan_scene(scene, global.cache, bar.listener());
  }
  for (const std::string& doubt : plan.warnings) spdlog::warn("{}", doubt);
  sim::Capture capture;
  std::string warning;
  std::string summary;
  std::vector<std::string> doubts;
  {
    ProgressBar bar(global.quiet);
    const Progress progress = bar.listener();
    const auto gel = sim::set_up_gel(scene.device, global.cache, progress);
    const auto vibration = sim::set_up_vibration(scene, plan, global.cache);
    const auto elastic = sim::set_up_elastic_objects(scene, plan, global.cache);
    const std::vector<sim::Truth> truths = sim::play_motion(scene, plan, *gel, progress, vibration.get(), elastic);
    const sim::Truth& wanted = truths[static_cast<std::size_t>(frame)];
    doubts = sim::touch_doubts(scene, *gel, wanted.press);
    if (picture || truth) capture = sim::VirtualCamera(scene, plan, *gel, truths).capture(wanted);
    if (!options.gltf.empty()) {
      const sim::FrameGeometry geometry = sim::frame_geometry(scene, *gel, wanted.press);
      sim::write_glb(options.gltf, geometry.parts, geometry.cameras);
    }
    if (events) {
      const sim::EventStreamReport report = write_events(options, scene, plan, *gel, wanted.t_us, global, progress);
      summary =
          fmt::format("{} events from {} pictures; {} times a pixel passed more than a threshold from one to the next",
                      report.events, report.pictures, report.coarse_steps);
      if (report.keys > 0) {
        summary += fmt::format(
            "; {} states were drawn in full, the pictures moved from them: at the next one they were up "
            "to {:.2g} % off (root mean square)",
            report.keys, 100.0 * report.worst_key_rms);
      }
    }
    warning = gel->report.note;
  }
  if (!warning.empty()) spdlog::warn("{}", warning);
  for (const std::string& doubt : doubts) spdlog::warn("frame {}: {}", frame, doubt);
  if (!summary.empty()) spdlog::info("{}", summary);
  if (!capture.light.empty()) spdlog::info("{}", capture.light);
  if (truth) sim::write_exr(options.truth, capture.pixel_truth.image, capture.pixel_truth.channel_names);
  constexpr double kMuchSaturated = 0.25;
  const double saturated = saturated_share(options.ideal ? capture.ideal : capture.frame);
  if (saturated > kMuchSaturated) {
    spdlog::warn("{:.0f} % of the picture's pixels are saturated: a shorter camera.exposure_us or a smaller lamp_level",
                 100.0 * saturated);
  }
  if (picture) sim::write_png(options.out, options.ideal ? capture.ideal : capture.frame);
  if (options.exr) {
    std::filesystem::path exr = options.out;
    sim::write_exr(exr.replace_extension(".exr"), capture.radiance, sim::channel_names(plan.bands));
  }
}

}  // namespace

void add_render_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand("render", "Make one picture of a scene, as the camera delivers it");
  auto options = std::make_shared<RenderOptions>();
  command->add_option("SCENE", options->scene, "Scene file")->required();
  command->add_option("-o,--out", options->out, "The picture: a .png file");
  command->add_option("--frame", options->frame, "Number of the frame, from 0 (default: the last)")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--ideal", options->ideal, "Without the imager's noise");
  command->add_flag("--exr", options->exr, "Beside it the linear irradiance on the sensor, as .exr (W/m^2 a band)");
  command->add_option("--truth", options->truth,
                      "Depth, normals, ids, contact and flow of each pixel, as layers of one .exr file");
  command->add_option(
      "--events", options->events,
      "All events from the first frame to the last: an .h5 (DSEC), .raw (EVT 3.0), .aedat4, .txt or .csv file");
  command->add_option("--events-picture", options->events_picture,
                      "The events of the 20 ms before the frame, ON red and OFF blue: a .png file");
  command->add_option("--gltf", options->gltf, "The frame's geometry for 3D viewers: a .glb file (glTF 2.0)");
  command->callback([&action, &global, options] { action = [options, &global] { render(*options, global); }; });
}

}  // namespace touchstone::apps
