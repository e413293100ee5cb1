#include <memory>

#include "apps/command.h"
#include "apps/estimators/overlay_sink.h"
#include "apps/estimators/tracker_options.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/sets/csv_cells.h"
#include "lab/vhs/bead_tractions.h"
#include "sensors/beads/bead_overlay.h"
#include "sensors/beads/stiffness_model_file.h"
#include "sensors/tractions/marker_compliance_file.h"

namespace touchstone::apps {
namespace {

constexpr const char* kAxes = "xyz";

struct EstimateOptions {
  std::filesystem::path model;
  std::filesystem::path out, overlay;
  std::string rest = "model";
  std::filesystem::path compliance;
  std::filesystem::path distribution;
  sensors::ViewParallax parallax;
  sensors::TractionSettings inversion = lab::bead_inversion();
};

std::string csv_of(const std::vector<lab::ForceRecord>& records) {
  std::string csv =
      "sequence,frame,t_us,force_x_N,force_y_N,force_z_N,true_x_N,true_y_N,true_z_N,extrapolated,beads_missing\n";
  for (const lab::ForceRecord& record : records) {
    const Eigen::Vector3d& force = record.estimate.force;
    csv += fmt::format("{},{},{},{:.6f},{:.6f},{:.6f},", datasets::csv_cell(record.sequence), record.frame,
                       record.estimate.t_us, force.x(), force.y(), force.z());
    if (record.truth) {
      csv += fmt::format("{:.6f},{:.6f},{:.6f}", record.truth->x(), record.truth->y(), record.truth->z());
    } else {
      csv += ",,";
    }
    csv += fmt::format(",{},{}\n", record.estimate.extrapolated ? 1 : 0, record.estimate.beads_missing);
  }
  return csv;
}

void print_errors(const std::string& title, const std::array<lab::AxisErrors, 3>& errors) {
  fmt::print("\n{}\n", title);
  fmt::print("  axis  frames  mean error N    RMS N    max N   published N\n");
  for (int axis = 0; axis < 3; ++axis) {
    if (errors[axis].frames == 0) continue;
    fmt::print("  {:<4}  {:>6}  {:>12.4f} {:>8.4f} {:>8.4f}   below {:.1f}\n", kAxes[axis], errors[axis].frames,
               errors[axis].mean_absolute, errors[axis].rms, errors[axis].largest, lab::kPublishedForceError_N);
  }
}

/// The table of [VisioHaptic2024, sec. 4.4]: load by load, true and estimated.
void print_verification(const lab::Verification& verification) {
  fmt::print("  axis    load N  frames    true N  estimated N  mean error N   published N\n");
  for (int axis = 0; axis < 3; ++axis) {
    for (const lab::LoadLevel& level : verification.levels[axis]) {
      fmt::print("  {:<4}  {:>8.1f}  {:>6}  {:>8.3f}  {:>11.3f}  {:>12.4f}   below {:.1f}\n", kAxes[axis], level.load,
                 level.frames, level.mean_true, level.mean_estimated, level.mean_absolute_error,
                 lab::kPublishedForceError_N);
    }
  }
  print_errors("Over these loads:", verification.errors);
  if (verification.error_at_5N_percent) {
    fmt::print("  at 5 N: {:.2f} % (published 2 %)\n", *verification.error_at_5N_percent);
  }
}

void write_distribution(const EstimateOptions& options, const std::vector<lab::TrackedSequence>& tracked,
                        const sensors::StiffnessForceModel& model) {
  const std::vector<Eigen::Vector2d> rest = options.rest == "first" ? std::vector<Eigen::Vector2d>() : model.rest;
  const lab::TractionSummary summary =
      lab::write_bead_tractions(tracked, rest, sensors::load_marker_compliance(options.compliance), options.parallax,
                                options.inversion, options.distribution);
  fmt::print("{}: tractions.csv and forces.csv of {} frames, {} of them in contact\n", options.distribution.string(),
             summary.frames, summary.in_contact);
  if (summary.without_force > 0) {
    fmt::print("  {} frames with too few beads for a distribution\n", summary.without_force);
  }
}

/// What draws each frame's beads with the force that they give; of the model's rest positions, or those of the first
/// frame that is drawn.
std::function<void(const datasets::SourceFrame&, const sensors::TrackedBeads&)> drawn_forces(
    OverlaySink& sink, const sensors::StiffnessForceModel& model, bool first_is_rest) {
  if (!sink.wanted()) return {};
  std::vector<Eigen::Vector2d> rest = first_is_rest ? std::vector<Eigen::Vector2d>() : model.rest;
  return [&sink, &model, rest, picture = cv::Mat()](const datasets::SourceFrame& frame,
                                                    const sensors::TrackedBeads& beads) mutable {
    if (rest.empty()) rest = beads.positions;
    sensors::draw_overlay(frame.image, beads, sensors::estimate(model, beads, rest), picture);
    sink.take(frame, picture);
  };
}

void estimate(const EstimateOptions& options, const FrameOptions& frames, const PictureOptions& pictures,
              const GlobalOptions& global) {
  if (options.compliance.empty() != options.distribution.empty()) {
    fail("--compliance and --distribution belong together: the gel's compliance, and the folder for the result");
  }
  if (!options.out.empty()) require_writable_place(options.out);
  const sensors::StiffnessForceModel model = sensors::load_stiffness_model(options.model);
  FrameOptions with_grid = frames;
  with_grid.tracker.grid = model.grid;
  const bool first_is_rest = options.rest == "first";
  OverlaySink sink(pictures, options.overlay, "forces of " + frames.source->choice.place);
  const std::vector<lab::TrackedSequence> tracked =
      tracked_frames(with_grid, global, drawn_forces(sink, model, first_is_rest));
  sink.finish();
  if (!options.compliance.empty()) write_distribution(options, tracked, model);
  const lab::RestChoice rest = first_is_rest ? lab::RestChoice::first_frame : lab::RestChoice::model;
  const std::vector<lab::ForceRecord> records = lab::estimate_forces(tracked, model, rest);
  if (!options.out.empty()) {
    write_whole_file(options.out, csv_of(records));
  }
  const bool truth_is_known = std::any_of(records.begin(), records.end(),
                                          [](const lab::ForceRecord& record) { return record.truth.has_value(); });
  if (!truth_is_known) {
    if (options.out.empty() && options.distribution.empty()) fmt::print("{}", csv_of(records));
    return;
  }
  fmt::print("Force by load, {}:\n",
             frames.source->choice.forces.empty() ? "split '" + frames.source->split + "'" : "recorded frames");
  print_verification(lab::verify_forces(records));
  print_errors("Over all frames:", lab::force_errors(records));
}

}  // namespace

void add_vhs_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      estimations.add_subcommand("vhs", "Force from its frames; where the true forces are known, the errors too");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The model that `touchstone calibrate` made")->required();
  const auto frames = add_frame_options(*command, "validate");
  command->add_option("-o,--out", options->out, "The forces: a .csv file, one line a frame");
  command
      ->add_option("--rest", options->rest,
                   "Displacements are measured from the 'model's rest positions, or from the 'first' frame's")
      ->check(CLI::IsMember({"model", "first"}))
      ->capture_default_str();
  command->add_option("--compliance", options->compliance,
                      "The gel's, by `touchstone export compliance`: tractions, so forces at several points, too");
  command->add_option("--distribution", options->distribution,
                      "The folder of tractions.csv and forces.csv that the compliance gives");
  command
      ->add_option(
          "--viewing-distance-mm", options->parallax.viewing_distance_mm,
          "Apparent distance of the camera from the beads, for their parallax: n_gel (air + plate / n_plate) + "
          "gel; 29.3 for scenes/devices/vhs.yaml; 0: far away")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--lateral-noise-mm", options->inversion.lateral_noise_mm,
                   "Error of a bead's displacement along x and y, for the tractions")
      ->check(CLI::Range(1e-5, 1.0))
      ->capture_default_str();
  command->add_option("--overlay", options->overlay, "A folder for pictures of the frames with beads and force");
  const auto pictures = add_picture_options(*command);
  command->callback([&action, &global, options, frames, pictures] {
    action = [options, frames, pictures, &global] { estimate(*options, *frames, *pictures, global); };
  });
}

}  // namespace touchstone::apps
