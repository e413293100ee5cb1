#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/reflex_options.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "lab/reflex/register_table.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path presses, out;
  double contact_N = 0.02;
  int degree = 1, terms = 3;
};

std::string shear_text(const std::optional<double>& shear_rms_N) {
  return shear_rms_N ? fmt::format(", shear by {:.4f} N", *shear_rms_N) : "";
}

void print_errors(const char* of, const sensors::ReflexErrors& errors) {
  fmt::print(
      "  {}: {:.2f} % of frames decided wrongly ({} missed, {} false alarms); normal force off by {:.4f} N{} (RMS)\n",
      of, errors.wrong_percent(), errors.missed, errors.alarms, errors.rms_N, shear_text(errors.shear_rms_N));
}

void print_errors(const char* of, const sensors::ExploreErrors& errors) {
  fmt::print("  {}: presses off by {:.4f} mm, normal force by {:.4f} N{} (RMS)\n", of, errors.press_rms_mm,
             errors.normal_rms_N, shear_text(errors.shear_rms_N));
}

void print_no_shear(const std::string& why) {
  if (!why.empty()) fmt::print("  no shear: {}\n", why);
}

void calibrate_registers(const CalibrateOptions& options, const ReflexOptions& chip) {
  if (!options.presses.empty()) fail("--presses is for --frames; tables of registers have their forces beside them");
  const lab::KnownRegisters known = lab::read_known_registers(chip.registers, options.contact_N);
  sensors::ReflexTraining training;
  training.degree = options.degree;
  const sensors::TrainedReflex made = sensors::train_reflex(known.recordings, training);
  sensors::save(made.model, options.out);
  warn_of_faults(known.faults);
  if (known.faulty > 0) spdlog::warn("{} frames can't be believed (dark, saturated, ...): left out", known.faulty);
  fmt::print("{}: learned from {} frames of {} recordings, {} of them in contact\n", options.out.string(), made.samples,
             known.recordings.size(), made.contacts);
  fmt::print("  a force is present if {}\n", sensors::rule_of(made.model.tree));
  print_errors("on these", sensors::test_reflex(made.model, known.recordings));
  const auto left_out = sensors::cross_validate_reflex(known.recordings, training);
  if (left_out) print_errors("on recordings left out in turn", *left_out);
  print_no_shear(made.no_shear);
}

void calibrate_pictures(const CalibrateOptions& options, const ReflexOptions& chip, const GlobalOptions& global) {
  if (options.presses.empty()) fail("--frames needs --presses CSV, what pressed in its pictures");
  lab::ExploreCalibration result;
  {
    ProgressBar bar(global.quiet);
    result = lab::calibrate_explore(picture_streams(chip), options.presses, picture_settings(chip), options.terms,
                                    bar.listener());
  }
  sensors::save(result.made.model, options.out);
  warn_of_faults(result.faults);
  warn_of_notes(*chip.frames);
  const sensors::ExponentialForce& law = result.made.model.force;
  fmt::print("{}: learned from {} pictures; force {:.4f} N (exp({:.4f} press / mm) - 1)\n", options.out.string(),
             result.pictures, law.scale_N, law.rate_per_mm);
  print_errors("on these", result.fitted);
  if (result.left_out) print_errors("on sequences left out in turn", *result.left_out);
  print_no_shear(result.made.no_shear);
}

}  // namespace

void add_reflex_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command = calibrations.add_subcommand(
      "reflex",
      "Learn forces of a fingertip on a motion chip: of its registers (reflex mode) or of pictures of dots (explore)");
  auto options = std::make_shared<CalibrateOptions>();
  const auto chip = add_reflex_options(*command, {});
  command
      ->add_option("--contact-N", options->contact_N,
                   "Of --registers: above this normal force something presses; above the force sensor's noise")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      ->add_option("--degree", options->degree,
                   "Of --registers: 1, force is linear in the statistics as published; 2, with their products")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  command->add_option("--presses", options->presses,
                      "Of --frames: CSV with the header file,press_mm,force_x_N,force_y_N,force_z_N,lateral_x_mm,"
                      "lateral_y_mm, what pressed in a picture; cells of force_x, force_y and lateral may be empty");
  command->add_option("--terms", options->terms, "Of --frames: terms of the law from dilation to press; 1 as published")
      ->check(CLI::Range(1, 3))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model: a .json file")->required();
  command->callback([&action, &global, options, chip] {
    action = [options, chip, &global] {
      require_writable_place(options->out);
      if (has_pictures(*chip)) {
        calibrate_pictures(*options, *chip, global);
      } else {
        calibrate_registers(*options, *chip);
      }
    };
  });
}

}  // namespace touchstone::apps
