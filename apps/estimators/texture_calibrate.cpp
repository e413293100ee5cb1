#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/surface_options.h"
#include "apps/progress_bar.h"
#include "lab/gelsight/texture_table.h"
#include "sensors/texture/texture_model_file.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path labels, out;
  lab::TextureLearning how;
};

void calibrate(const CalibrateOptions& options, const SurfaceOptions& surfaces, const GlobalOptions& global) {
  require_writable_place(options.out);
  lab::HeightSource source = height_source(surfaces);
  lab::TextureCalibration made;
  {
    ProgressBar bar(global.quiet);
    made = lab::learn_textures(source, folder_of(surfaces), options.labels, options.how, bar.listener());
  }
  sensors::save(made.model, options.out);
  warn_of_faults(made.faults);
  fmt::print("{}: {} materials, {} samples of {} height maps\n", options.out.string(), made.model.classes.size(),
             made.model.labels.size(), made.maps);
  if (made.left_out > 0) {
    fmt::print(
        "  of {} maps that were left out in turn {} are named right ({:.1f} %), the farthest at a distance of {:.3f}\n",
        made.left_out, made.right, 100.0 * made.right / made.left_out, made.farthest_right);
  }
}

}  // namespace

void add_texture_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command = calibrations.add_subcommand("texture", "Learn materials from height maps of their surfaces");
  auto options = std::make_shared<CalibrateOptions>();
  const auto surfaces = add_surface_options(*command);
  command
      ->add_option("--labels", options->labels, "CSV with the header file,material; files are relative to the folder")
      ->required();
  command->add_option("--square-px", options->how.square_px, "Side of the squares that each map is cut into, px")
      ->check(CLI::Range(1, 8192))
      ->capture_default_str();
  command
      ->add_option("--grey-step-mm", options->how.gray_step_mm,
                   "Height of a grey level: above the maps' noise, below the texture's relief")
      ->check(CLI::Range(1e-6, 1.0))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model's file")->required();
  command->callback([&action, &global, options, surfaces] {
    action = [options, surfaces, &global] { calibrate(*options, *surfaces, global); };
  });
}

}  // namespace touchstone::apps
