#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "sim/frame_geometry.h"
#include "sim/gltf_writer.h"
#include "sim/image_file.h"
#include "sim/virtual_sensor.h"

namespace touchstone::apps {
namespace {

struct RenderOptions {
  std::filesystem::path scene;
  std::filesystem::path out;
  std::filesystem::path gltf;
  std::filesystem::path truth;
  int frame = -1;
  bool ideal = false;
  bool exr = false;
};

void require_ending(const std::filesystem::path& file, const char* ending, const char* whose) {
  if (file.empty()) return;
  if (file.extension() != ending) fail("{}: {} name must end in {}", file.string(), whose, ending);
  require_writable_place(file);
}

void render(const RenderOptions& options, const GlobalOptions& global) {
  const bool picture = !options.out.empty();
  const bool truth = !options.truth.empty();
  require_ending(options.out, ".png", "the picture's");
  require_ending(options.gltf, ".glb", "the geometry's");
  require_ending(options.truth, ".exr", "the truth's");
  if (!picture && !truth && options.gltf.empty()) fail("nothing to make: give --out, --truth or --gltf");
  if (options.exr && !picture) fail("--exr: is written beside the picture; give --out");
  sim::SceneSpec scene = sim::read_scene(options.scene);
  scene.outputs = {.frames = picture && !options.ideal, .ideal = picture && options.ideal, .radiance = options.exr};
  scene.outputs.depth = scene.outputs.normals = scene.outputs.ids = truth;
  scene.outputs.contact = scene.outputs.flow = truth;
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
    const auto elastic = sim::set_up_elastic_objects(scene, plan, global.cache);
    const std::vector<sim::Truth> truths = sim::play_motion(scene, plan, *gel, progress, vibration.get(), elastic);
    const sim::Truth& wanted = truths[static_cast<std::size_t>(frame)];
    if (plan.camera) capture = sim::VirtualCamera(scene, plan, *gel, truths.front()).capture(wanted);
    if (!options.gltf.empty()) {
      const sim::FrameGeometry geometry = sim::frame_geometry(scene, *gel, wanted.press);
      sim::write_glb(options.gltf, geometry.parts, geometry.cameras);
    }
    warning = gel->report.note;
  }
  if (!warning.empty()) spdlog::warn("{}", warning);
  if (truth) sim::write_exr(options.truth, capture.pixel_truth.image, capture.pixel_truth.channel_names);
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
  command->add_option("--gltf", options->gltf, "The frame's geometry for 3D viewers: a .glb file (glTF 2.0)");
  command->callback([&action, &global, options] { action = [options, &global] { render(*options, global); }; });
}

}  // namespace touchstone::apps
