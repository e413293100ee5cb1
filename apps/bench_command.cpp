#include <spdlog/spdlog.h>

#include <cmath>
#include <memory>
#include <optional>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/whole_file.h"
#include "lab/bench/device_bench.h"
#include "lab/studies/study.h"

namespace touchstone::apps {
namespace {

struct BenchOptions {
  std::filesystem::path device, out, object;
  double force_error_percent = 1.0;
  std::optional<double> depth_mm;
  bool no_finite_strain = false;
  bool no_estimator = false;
  lab::BenchSettings settings;
};

void print_choice(const lab::BenchChoice& choice) {
  fmt::print("cheapest: edges of {:.3g} mm{}, {:.3g} s once and {:.3g} s a frame; as it is {:.3g} s and {:.3g} s\n",
             choice.fine_mm, choice.light_words.empty() ? "" : ", " + choice.light_words, choice.once_s, choice.frame_s,
             choice.as_is_once_s, choice.as_is_frame_s);
  fmt::print("on other presses: force {:.2g} % off{}: {}\n", 100.0 * choice.verified_force,
             std::isfinite(choice.verified_pixel) ? fmt::format(", pixels {:.2g} of the noise", choice.verified_pixel)
                                                  : std::string(),
             choice.holds ? "holds" : "doesn't hold");
}

void print_estimator(const lab::DeviceBench& bench) {
  if (!bench.estimator) return;
  const lab::EstimatorBench& found = *bench.estimator;
  if (!found.none.empty()) {
    fmt::print("no estimator is measured: {}\n", found.none);
    return;
  }
  const auto [least, most] = found.reference.range();
  fmt::print("{} of the device's estimator, trained on {} frames as planned: {:.3g} to {:.3g} {} off\n", found.quantity,
             found.reference.frames, least, most, found.unit);
}

void bench(const BenchOptions& options, const GlobalOptions& global) {
  const sim::DeviceSpec device = sim::read_device(options.device);
  lab::BenchSettings settings = options.settings;
  settings.force_error = 0.01 * options.force_error_percent;
  settings.depth_mm = options.depth_mm;
  settings.finite_strain = !options.no_finite_strain;
  settings.estimator.on = !options.no_estimator;
  if (!options.object.empty()) settings.object = sim::read_object(options.object);
  lab::make_study_folder(options.out);  // before minutes of work that couldn't be kept
  lab::DeviceBench measured;
  {
    ProgressBar bar(global.quiet);
    measured = lab::bench_device(device, settings, bar.listener());
  }
  const lab::StudyResult result = lab::report(measured, read_whole_file(options.device));
  for (const std::string& note : result.notes) spdlog::warn("{}", note);
  lab::write_study(result, options.out);
  print_estimator(measured);
  for (const lab::PlannedWay& way : measured.planned.ways) {
    fmt::print("as planned {}: force {:.2g} % off, pixels {:.2g} of the noise, {:.3g} s a frame\n", way.name,
               100.0 * measured.planned.force_error, way.pixel_error, way.frame_s);
  }
  if (!settings.estimator.alone && !settings.planned_alone) print_choice(measured.choice);
  for (const lab::StudyFile& written : result.files) fmt::print("{}\n", (options.out / written.name).string());
}

}  // namespace

void add_bench_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand(
      "bench",
      "Measure what accuracy costs on a device: error against seconds, the cheapest setting, each effect's share");
  auto options = std::make_shared<BenchOptions>();
  command->add_option("DEVICE", options->device, "Device file")->required();
  command->add_option("-o,--out", options->out, "Folder for the page, its table and plots; is made")->required();
  command->add_option("--force-error", options->force_error_percent, "Wanted: percent of a force (default 1)");
  command->add_option("--pixel-error", options->settings.pixel_error,
                      "Wanted: part of the imager's noise, root mean square over pixels (default 1)");
  command->add_option("--object", options->object, "Object file (default: a ball of the gel's thickness, in radius)");
  command->add_option("--depth", options->depth_mm,
                      "mm that it is pressed in (default: a tenth of the gel's thickness)");
  command->add_option("--pixels", options->settings.most_pixels,
                      "Compare pictures on so many pixels of their middle (default 19200)");
  command->add_option("--seed", options->settings.seed, "Of the presses' places and of the light (default 1)");
  command->add_flag("--no-finite-strain", options->no_finite_strain,
                    "Leave out the press at finite strain, which takes up to minutes");
  command->add_flag("--no-estimator", options->no_estimator,
                    "Leave out what the device's own estimator errs by, which takes up to ten minutes");
  command->add_flag("--only-estimator", options->settings.estimator.alone, "Measure that alone")
      ->excludes("--no-estimator");
  command
      ->add_flag(
          "--only-planned", options->settings.planned_alone,
          "Measure what the device's plans hold as they are, by fixed shares and by need, without curves: minutes")
      ->excludes("--only-estimator");
  command->add_option("--training-frames", options->settings.estimator.training_frames,
                      "That the estimator is trained on: an even number (default 12 of heights, 24 of forces)");
  command->add_option("--estimator-row", options->settings.estimator.rows,
                      "Of the estimator's table this row alone, beside the plan's; may be given several times");
  command->callback([&action, &global, options] { action = [&global, options] { bench(*options, global); }; });
}

}  // namespace touchstone::apps
