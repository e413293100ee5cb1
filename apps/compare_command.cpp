#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/whole_file.h"
#include "lab/likeness/likeness.h"
#include "lab/studies/study.h"

namespace touchstone::apps {
namespace {

struct CompareOptions {
  std::filesystem::path device;
  lab::LikenessSpec spec;
  double deepest_mm = 0.0;
  std::filesystem::path out;
  std::filesystem::path residual;
};

void compare(const CompareOptions& options, const GlobalOptions& global) {
  const sim::DeviceSpec device = sim::read_device(options.device);
  lab::LikenessSpec spec = options.spec;
  if (options.deepest_mm > 0.0) spec.deepest_mm = options.deepest_mm;
  spec.residual = !options.residual.empty();
  const lab::BallRecording recording = lab::read_ball_recording(spec);
  if (!options.out.empty()) lab::make_study_folder(options.out);
  lab::Likeness likeness;
  {
    ProgressBar bar(global.quiet);
    likeness = lab::compare_likeness(device, recording, spec, global.cache, bar.listener());
  }
  for (const lab::PressLikeness& press : likeness.presses) {
    if (!press.shallow) continue;
    spdlog::warn("{}: the annotated contact of {} px takes more than the {:.2f} mm that it was pressed in by",
                 press.name, press.radius_px, press.depth_mm);
  }
  fmt::print("{}", lab::to_text(lab::summary_of(likeness)));
  fmt::print("{:.2f} s a press; {}\n", likeness.seconds_a_press, likeness.light);
  if (!likeness.residual.empty()) fmt::print("residual map: {}\n", likeness.residual);
  if (likeness.made_residual) {
    const lab::ResidualFit& made = *likeness.made_residual;
    for (const lab::LeftOutPress& press : made.left_out) {
      fmt::print("  {} left out: {:.2f} of 255 are missing, {:.2f} with a map of the others\n", press.name,
                 press.before_DN, press.after_DN);
    }
    write_whole_file(options.residual, sim::to_yaml(made.map));
    fmt::print("{}: the residual map; a device file names it by `residual`\n", options.residual.string());
  }
  if (options.out.empty()) return;
  lab::write_likeness(likeness, options.out);
  fmt::print("{}: a row a press in likeness.csv, pictures in likeness.png, the recorded frames with rest's colours\n",
             options.out.string());
}

}  // namespace

void add_compare_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand(
      "compare", "Measure how much a device's pictures are like a real sensor's recorded presses of a ball");
  auto options = std::make_shared<CompareOptions>();
  options->spec.rest = {"rest.png"};
  command->add_option("DEVICE", options->device, "Device file; its camera must have the recording's picture")
      ->required();
  command
      ->add_option("RECORDING", options->spec.recording,
                   "Folder with presses.csv, or such a table as `calibrate gelsight` takes, beside its pictures")
      ->required();
  command->add_option("--mm-per-px", options->spec.mm_per_px, "Size of a recorded pixel on the gel, mm")
      ->required()
      ->check(CLI::Range(1e-4, 10.0));
  command->add_option("--rest", options->spec.rest, "Pictures of the untouched gel, one or more (default rest.png)");
  command->add_option(
      "--learn", options->spec.learn,
      "Files of presses that the device was fitted to: a table from slopes to colours learns from them, "
      "and means and ranges leave them out");
  command
      ->add_option("--deepest-mm", options->deepest_mm,
                   "How deep a press may be whose contact is as wide as annotated (default 0.6 of the gel's thickness)")
      ->check(CLI::Range(0.01, 100.0));
  command->add_option("--residual", options->residual,
                      "Learn a residual map from the presses of --learn, compare the device with it, too, and write it "
                      "to this file");
  command->add_option("--seed", options->spec.seed, "Of the simulated light (default 1)");
  command->add_option("-o,--out", options->out, "Folder for the table and the pictures; is made");
  command->callback([&action, &global, options] { action = [&global, options] { compare(*options, global); }; });
}

}  // namespace touchstone::apps
