#include <fmt/ranges.h>

#include <memory>

#include "apps/command.h"
#include "core/error.h"
#include "lab/gelsight/ball_press_table.h"
#include "sensors/heights/height_calibration.h"
#include "sensors/heights/height_model_file.h"

namespace touchstone::apps {
namespace {

namespace fs = std::filesystem;

struct CalibrateOptions {
  fs::path frames;
  fs::path annotations;
  std::vector<fs::path> background;
  double mm_per_px = 0.0;
  std::string correction = "best";
  fs::path out;
};

/// A background is named like the table's pictures, relative to their folder, or by a path of its own.
std::vector<fs::path> background_files(const CalibrateOptions& options) {
  std::vector<fs::path> files;
  for (const fs::path& name : options.background) {
    const fs::path beside = options.frames / name;
    files.push_back(fs::exists(beside) ? beside : name);
  }
  return files;
}

sensors::LightCorrection correction_named(const std::string& name) {
  if (name == "none") return sensors::LightCorrection::none;
  if (name == "background") return sensors::LightCorrection::background;
  TS_ASSERT(name == "fitted");
  return sensors::LightCorrection::fitted;
}

void calibrate(const CalibrateOptions& options) {
  require_writable_place(options.out);
  const std::vector<lab::AnnotatedPress> table = lab::read_ball_press_table(options.frames, options.annotations);
  const sensors::Background background = lab::read_background(background_files(options));
  const std::vector<sensors::BallPress> presses = lab::read_ball_presses(table, background, options.mm_per_px);
  sensors::HeightCalibrationSettings settings;
  settings.mm_per_px = options.mm_per_px;
  if (options.correction != "best") settings.correction = correction_named(options.correction);
  settings.cross_validate = true;
  const sensors::HeightCalibration result = sensors::calibrate_height(presses, background, settings);
  sensors::save(result.model, options.out);

  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (table[i].circle) continue;
    const sensors::ContactCircle& circle = presses[i].circle;
    fmt::print("{}: contact found at ({:.2f}, {:.2f}), radius {:.2f} px\n", presses[i].name, circle.centre.x(),
               circle.centre.y(), circle.radius);
  }
  fmt::print("{}: {} presses, {} pixels; slopes of these are off by {:.4f} (RMS)\n", options.out.string(),
             presses.size(), result.pixels, result.rms_slope_error);
  fmt::print("  table: {} of {} cells hit, step {:.2f}, slopes to {:.2f}\n", result.coverage.cells_hit,
             result.coverage.cells, result.model.table.step, result.coverage.steepest_slope);
  if (result.bounded_share > 0.0) {
    fmt::print("  {:.1f} % of the picture is too dark or too one-sidedly lit to be corrected in full\n",
               100.0 * result.bounded_share);
  }
  for (const sensors::SlopeError& error : result.left_out) {
    fmt::print("  correction '{}': slopes of a press that was left out are off by {:.4f} (RMS)\n",
               sensors::name_of(error.correction), error.rms);
  }
}

}  // namespace

void add_gelsight_calibration(CLI::App& calibrations, const GlobalOptions&, Action& action) {
  CLI::App* command = calibrations.add_subcommand(
      "gelsight", "Make its table from colours to slopes of frames of a pressed ball, simulated or recorded");
  auto options = std::make_shared<CalibrateOptions>();
  command->add_option("--frames", options->frames, "The folder of the pictures")->required();
  command
      ->add_option("--annotations", options->annotations,
                   "CSV with the header file,u_px,v_px,radius_px,ball_diameter_mm: the outline of the touched part of "
                   "the ball in each picture, or three empty cells where it is to be found")
      ->required();
  command->add_option("--background", options->background, "Pictures of the untouched gel, one or more")->required();
  command->add_option("--mm-per-px", options->mm_per_px, "Size of a pixel on the gel, mm")
      ->required()
      ->check(CLI::Range(1e-4, 10.0));
  command
      ->add_option(
          "--correction", options->correction,
          "Of colours for the place: 'none', by the 'background', by lamps 'fitted' to the presses, or the 'best' "
          "on presses that were left out")
      ->check(CLI::IsMember({"best", "none", "background", "fitted"}))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model's file")->required();
  command->callback([&action, options] { action = [options] { calibrate(*options); }; });
}

}  // namespace touchstone::apps
