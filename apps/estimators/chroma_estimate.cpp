#include <fmt/format.h>

#include <memory>
#include <optional>

#include "apps/command.h"
#include "apps/estimators/chroma_grid.h"
#include "apps/estimators/overlay_sink.h"
#include "apps/estimators/source_options.h"
#include "apps/progress_bar.h"
#include "lab/chroma/chroma_fields.h"
#include "sensors/colour/colour_overlay.h"
#include "sensors/colour/hue_model_file.h"
#include "sensors/tractions/marker_compliance_file.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model;
  std::filesystem::path rest;
  std::filesystem::path compliance;
  std::filesystem::path out;
  std::string grid = "10x10";
  bool overlay = false;
  double arrow_scale = 3.0;
  sensors::TractionSettings inversion;
};

void estimate(const EstimateOptions& options, const SourceOptions& source, const PictureOptions& pictures,
              const GlobalOptions& global) {
  const sensors::HueModel model = sensors::load_hue_model(options.model);
  const Eigen::Vector2i grid = grid_of(options.grid);
  std::optional<lab::FieldForces> forces;
  if (!options.compliance.empty()) {
    forces = lab::FieldForces{sensors::load_marker_compliance(options.compliance), options.inversion};
  }
  OverlaySink sink(pictures, options.overlay ? options.out / "overlay" : "", "markers of " + source.choice.place);
  lab::ShowField show;
  if (sink.wanted()) {
    show = [&, picture = cv::Mat()](const datasets::SourceFrame& frame, const lab::ShownField& shown) mutable {
      const sensors::ColourOverlay how{options.arrow_scale, shown.force_N, shown.slip};
      sensors::draw_overlay(frame.image, shown.rest, shown.seen, shown.field, picture, how);
      sink.take(frame, picture);
    };
  }
  ProgressBar bar(global.quiet);
  const lab::FieldSummary summary = lab::write_chroma_fields(model, grid, options.rest, opened_streams(source), forces,
                                                             options.out, bar.listener(), show);
  sink.finish();
  warn_of_faults(summary.faults);
  warn_of_notes(source);
  fmt::print("{}: displacements.csv{} of {} frames\n", options.out.string(), forces ? " and forces.csv" : "",
             summary.frames - std::ssize(summary.faults));
  fmt::print("  {} of {} markers measured, {} of them beyond what calibration saw\n", summary.measured, summary.markers,
             summary.extrapolated);
  if (summary.without_force > 0) {
    fmt::print("  {} frames with too few markers, measured and not beyond calibration, for a force\n",
               summary.without_force);
  }
}

}  // namespace

void add_chroma_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand("chroma", "Displacements of its markers, and forces, from its frames");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The model that `touchstone calibrate chroma` made")->required();
  command->add_option("--rest", options->rest, "The picture of the unloaded sensor as it is mounted now")->required();
  const auto source = add_source_options(*command, "--frames", {});
  add_grid_option(*command, options->grid);
  command->add_option("--compliance", options->compliance,
                      "The gel's, by `touchstone export compliance`: forces and friction, too");
  command
      ->add_option("--lateral-noise-mm", options->inversion.lateral_noise_mm,
                   "Error of a marker's displacement along x and y, for the forces")
      ->check(CLI::Range(1e-5, 1.0))
      ->capture_default_str();
  command->add_option("--normal-noise-mm", options->inversion.normal_noise_mm, "Likewise along z")
      ->check(CLI::Range(1e-5, 1.0))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The folder of displacements.csv and forces.csv")->required();
  command->add_flag("--overlay", options->overlay, "Pictures of the frames with markers, force and slip, too");
  command->add_option("--arrow-scale", options->arrow_scale, "Length of their arrows for a displacement of 1 px, px")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  const auto pictures = add_picture_options(*command);
  command->callback([&action, options, source, pictures, &global] {
    action = [options, source, pictures, &global] { estimate(*options, *source, *pictures, global); };
  });
}

}  // namespace touchstone::apps
