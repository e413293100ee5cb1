#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "sim/image_file.h"
#include "sim/virtual_sensor.h"

namespace touchstone::apps {
namespace {

struct RenderOptions {
  std::filesystem::path scene;
  std::filesystem::path out;
  int frame = -1;
  bool ideal = false;
  bool exr = false;
};

void render(const RenderOptions& options, const GlobalOptions& global) {
  if (options.out.extension() != ".png") fail("{}: the picture's name must end in .png", options.out.string());
  require_writable_place(options.out);
  sim::SceneSpec scene = sim::read_scene(options.scene);
  scene.outputs = {.frames = !options.ideal, .ideal = options.ideal, .radiance = options.exr};
  const int frames = scene.motion.frame_count();
  const int frame = options.frame < 0 ? frames - 1 : options.frame;
  if (frame >= frames) {
    fail("--frame {}: the scene {} has frames 0 to {}", frame, options.scene.string(), frames - 1);
  }
  const sim::Plan plan = sim::make_plan(scene);
  sim::Capture capture;
  std::string warning;
  {
    ProgressBar bar(global.quiet);
    const Progress progress = bar.listener();
    const auto gel = sim::set_up_gel(scene.device, global.cache, progress);
    const auto vibration = sim::set_up_vibration(scene, plan, global.cache);
    const std::vector<sim::Truth> truths = sim::play_motion(scene, plan, *gel, progress, vibration.get());
    const sim::VirtualCamera camera(scene, plan, *gel, truths.front());
    capture = camera.capture(truths[static_cast<std::size_t>(frame)]);
    warning = gel->report.note;
  }
  if (!warning.empty()) spdlog::warn("{}", warning);
  sim::write_png(options.out, options.ideal ? capture.ideal : capture.frame);
  if (options.exr) {
    std::filesystem::path exr = options.out;
    sim::write_exr(exr.replace_extension(".exr"), capture.radiance, {"R", "G", "B"});
  }
}

}  // namespace

void add_render_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand("render", "Make one picture of a scene, as the camera delivers it");
  auto options = std::make_shared<RenderOptions>();
  command->add_option("SCENE", options->scene, "Scene file")->required();
  command->add_option("-o,--out", options->out, "The picture: a .png file")->required();
  command->add_option("--frame", options->frame, "Number of the frame, from 0 (default: the last)")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--ideal", options->ideal, "Without the imager's noise");
  command->add_flag("--exr", options->exr, "Beside it the linear irradiance on the sensor, as .exr (W/m^2 a band)");
  command->callback([&action, &global, options] { action = [options, &global] { render(*options, global); }; });
}

}  // namespace touchstone::apps
