#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/marker_options.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "lab/gelsight/touch_force_calibration.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::string indenter = "any";
  std::filesystem::path out;
};

void print_line(const std::string& what, const sensors::LinearForce& line, const std::string& left_out) {
  fmt::print("  {}; RMS error {:.4f} N, R2 {:.4f}{}\n", what, line.rms_residual_N, line.r2, left_out);
}

void calibrate(const CalibrateOptions& options, const MarkerOptions& frames, const GlobalOptions& global) {
  require_writable_place(options.out);
  const sensors::TouchCalibration parts = gel_parts(frames);
  if (!parts.height && parts.mm_per_px == 0.0) fail("--heights MODEL or --mm-per-px MM is needed");
  lab::TouchForceCalibration made;
  {
    ProgressBar bar(global.quiet);
    made = lab::calibrate_touch_forces(opened_streams(*frames.source), parts, frames.rest,
                                       name_of_source(*frames.source), options.indenter, bar.listener());
  }
  sensors::save(made.fit.model, options.out);
  warn_of_faults(made.faults);
  warn_of_notes(*frames.source);
  fmt::print("{}: forces of {} frames in contact, of {}\n", options.out.string(), made.samples, made.frames);
  const auto& [x, y, z] = made.fit.left_out_N;
  if (!made.fit.model.normal.empty()) {
    const sensors::LinearForce& line = made.fit.model.normal.front().line;
    print_line(
        fmt::format("normal force: {:.4g} N for each mm^3 of the dent, {:+.4f} N", line.newton_per_unit, line.offset_N),
        line, z ? fmt::format("; {:.4f} N on sequences left out", *z) : "");
  }
  if (made.fit.model.shear) {
    const sensors::LinearForce& line = *made.fit.model.shear;
    print_line(fmt::format("shear force: {:.4g} N for each mm", line.newton_per_unit), line,
               x && y ? fmt::format("; {:.4f} N along x, {:.4f} N along y on sequences left out", *x, *y) : "");
  } else {
    fmt::print("  no shear: the frames show too little of it\n");
  }
}

}  // namespace

void add_markers_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command = calibrations.add_subcommand(
      "markers", "Fit the forces of a gel with printed markers to frames whose forces are known");
  auto options = std::make_shared<CalibrateOptions>();
  const auto frames = add_marker_options(*command, "train");
  command->add_option("--indenter", options->indenter, "What is pressed, for the model: normal force depends on it")
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model: a .json file")->required();
  command->callback([&action, &global, options, frames] {
    action = [options, frames, &global] { calibrate(*options, *frames, global); };
  });
}

}  // namespace touchstone::apps
