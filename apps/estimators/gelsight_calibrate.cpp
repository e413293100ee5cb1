#include <fmt/ranges.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/source_options.h"
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
  double gel_thickness_mm = 4.0;
  std::string correction = "best";
  std::string slopes = "best";
  fs::path out;
};

sensors::LightCorrection correction_named(const std::string& name) {
  if (name == "none") return sensors::LightCorrection::none;
  if (name == "background") return sensors::LightCorrection::background;
  TS_ASSERT(name == "fitted");
  return sensors::LightCorrection::fitted;
}

sensors::SlopeRegressor regressor_named(const std::string& name) {
  if (name == "table") return sensors::SlopeRegressor::table;
  if (name == "network") return sensors::SlopeRegressor::network;
  TS_ASSERT(name == "best");
  return sensors::SlopeRegressor::best;
}

void print_presses(const sensors::HeightCalibration& result) {
  for (const sensors::PressUse& use : result.presses) {
    if (!use.flaw.empty()) {
      fmt::print("left out: {}\n", use.flaw);
    } else if (use.found) {
      fmt::print("{}: contact found at ({:.2f}, {:.2f}), radius {:.2f} px\n", use.name, use.circle.centre.x(),
                 use.circle.centre.y(), use.circle.radius);
    }
  }
}

void calibrate(const CalibrateOptions& options) {
  require_writable_place(options.out);
  datasets::TableFrames frames(options.frames);
  const std::vector<lab::AnnotatedPress> table = lab::read_ball_press_table(frames, options.annotations);
  const sensors::Background background = lab::read_background(frames, lab::rest_files(frames, options.background));
  const std::vector<sensors::BallPress> presses = lab::read_ball_presses(frames, table);
  sensors::HeightCalibrationSettings settings;
  settings.mm_per_px = options.mm_per_px;
  settings.gel_thickness_mm = options.gel_thickness_mm;
  settings.slopes = regressor_named(options.slopes);
  if (options.correction != "best") settings.correction = correction_named(options.correction);
  settings.cross_validate = true;
  const sensors::HeightCalibration result = sensors::calibrate_height(presses, background, settings);
  sensors::save(result.model, options.out);

  print_presses(result);
  fmt::print("{}: {} presses, {} pixels; the table's slopes of these are off by {:.4f} (RMS)\n", options.out.string(),
             result.model.presses, result.pixels, result.rms_slope_error);
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
  if (result.network_left_out) {
    fmt::print("  network: slopes of a press that was left out are off by {:.4f} (RMS)\n", *result.network_left_out);
  }
  fmt::print("  slopes are read by the {}; frames' white balance is {}\n", result.model.network ? "network" : "table",
             result.model.white_balance ? "taken out" : "the background's");
}

}  // namespace

void add_gelsight_calibration(CLI::App& calibrations, const GlobalOptions&, Action& action) {
  CLI::App* command = calibrations.add_subcommand(
      "gelsight", "Make its table from colours to slopes of frames of a pressed ball, simulated or recorded");
  auto options = std::make_shared<CalibrateOptions>();
  command->add_option("--frames", options->frames, kTableFramesHelp)->required();
  command
      ->add_option("--annotations", options->annotations,
                   "CSV with the header file,u_px,v_px,radius_px,ball_diameter_mm: the outline of the touched part of "
                   "the ball in each picture, or three empty cells where it is to be found")
      ->required();
  command
      ->add_option("--background", options->background,
                   "Pictures of the untouched gel, one or more: of these frames, or files elsewhere")
      ->required();
  command->add_option("--mm-per-px", options->mm_per_px, "Size of a pixel on the gel, mm")
      ->required()
      ->check(CLI::Range(1e-4, 10.0));
  command
      ->add_option("--gel-thickness-mm", options->gel_thickness_mm,
                   "Of the gel, mm: how far it sinks round a ball, which a network learns")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  command
      ->add_option(
          "--slopes", options->slopes,
          "What slopes are read by: a 'table' of colours, a 'network' that also sees their surroundings, or the "
          "'best' on presses that were left out")
      ->check(CLI::IsMember({"best", "table", "network"}))
      ->capture_default_str();
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
