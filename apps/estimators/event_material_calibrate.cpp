#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/event_options.h"
#include "apps/progress_bar.h"
#include "sensors/events/grasp_training.h"
#include "sensors/events/material_classifier_file.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path grasps, out;
  sensors::MaterialClassifierSettings classifier;
};

void calibrate(const CalibrateOptions& options, const EventOptions& events, const GlobalOptions& global) {
  require_writable_place(options.out);
  const lab::SeenGrasps grasps = seen_grasps(options.grasps, lab::GraspNeeds::materials, events, global);
  sensors::GraspMaterialCalibration made;
  {
    ProgressBar bar(global.quiet);
    made = sensors::calibrate_grasp_material(grasps.seen, options.classifier, global.threads, bar.listener());
  }
  sensors::save(made.model, options.out);
  fmt::print("{}: learnt from {} grasps of {} materials\n", options.out.string(), grasps.seen.size(),
             made.model.materials.size());
  fmt::print("  of grasps that were left out in turn {:.1f} % are named right\n", 100.0 * made.left_out.accuracy());
}

}  // namespace

void add_event_material_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      calibrations.add_subcommand("event-material", "Learn materials from an event camera's grasps of known pieces");
  auto options = std::make_shared<CalibrateOptions>();
  command
      ->add_option("--grasps", options->grasps,
                   "CSV with the header events,forces,material; files are relative to its folder, forces may be empty")
      ->required();
  const auto events = add_event_options(*command);
  command->add_option("--units", options->classifier.units, "Of the network, in each of its two hidden layers")
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model: a .json file")->required();
  command->callback([&action, &global, options, events] {
    action = [options, events, &global] { calibrate(*options, *events, global); };
  });
}

}  // namespace touchstone::apps
