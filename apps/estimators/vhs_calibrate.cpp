#include <memory>

#include "apps/command.h"
#include "apps/estimators/tracker_options.h"
#include "core/error.h"
#include "sensors/beads/stiffness_model_file.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path out;
  std::string stop = "text";
  std::string form = "asymmetric";
};

sensors::TrainingSettings training_settings(const CalibrateOptions& options) {
  sensors::TrainingSettings settings =
      options.stop == "text" ? sensors::TrainingSettings::as_published() : sensors::TrainingSettings::to_convergence();
  if (options.form == "symmetric") settings.form = sensors::MatrixForm::kSymmetric;
  if (options.form == "diagonal") settings.form = sensors::MatrixForm::kDiagonal;
  return settings;
}

void calibrate(const CalibrateOptions& options, const FrameOptions& frames, const GlobalOptions& global) {
  require_writable_place(options.out);
  const std::vector<lab::TrackedSequence> tracked = tracked_frames(frames, global);
  const sensors::ForceSamples samples = lab::training_samples(tracked, frames.tracker.grid);
  const sensors::TrainedModel trained = sensors::train(samples, training_settings(options));
  sensors::save(trained.model, options.out);
  const sensors::TrainingReport& report = trained.report;
  fmt::print("{}: trained on {} samples, {} iterations ({})\n", options.out.string(), samples.forces.size(),
             report.iterations, sensors::name_of(report.end));
  const char* axes = "xyz";
  for (int axis = 0; axis < 3; ++axis) {
    fmt::print("  force {}: RMS error {:.4f} N, R2 {:.4f}\n", axes[axis], std::sqrt(report.final_loss[axis]),
               report.r2[axis]);
  }
}

}  // namespace

void add_vhs_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      calibrations.add_subcommand("vhs", "Train its force model on frames with known forces, simulated or recorded");
  auto options = std::make_shared<CalibrateOptions>();
  const auto frames = add_frame_options(*command, "train");
  command->add_option("--grid", frames->tracker.grid, "Beads a side")->check(CLI::Range(2, 32))->capture_default_str();
  command->add_option("-o,--out", options->out, "The model: a .json file")->required();
  command
      ->add_option("--stop", options->stop,
                   "When training ends: 'text' (loss down by two orders of magnitude) or 'converged'")
      ->check(CLI::IsMember({"text", "converged"}))
      ->capture_default_str();
  command->add_option("--form", options->form, "Of each square's matrix")
      ->check(CLI::IsMember({"asymmetric", "symmetric", "diagonal"}))
      ->capture_default_str();
  command->callback([&action, &global, options, frames] {
    action = [options, frames, &global] { calibrate(*options, *frames, global); };
  });
}

}  // namespace touchstone::apps
