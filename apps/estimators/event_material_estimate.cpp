#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/event_options.h"
#include "apps/progress_bar.h"
#include "lab/dvs/grasp_estimates.h"
#include "sensors/events/material_classifier_file.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model, out;
  std::vector<std::filesystem::path> files;
};

void estimate(const EstimateOptions& options, const EventOptions& events, const GlobalOptions& global) {
  require_writable_place(options.out);
  const sensors::MaterialClassifier model = sensors::load_material_classifier(options.model);
  std::vector<lab::GraspMaterialRecord> records;
  {
    ProgressBar bar(global.quiet);
    records = lab::write_grasp_materials(model, options.files, read_options(events), options.out, bar.listener());
  }
  std::vector<std::string> faults;
  for (const lab::GraspMaterialRecord& record : records) {
    if (record.fault.empty()) {
      fmt::print("{}: {} ({:.1f} %)\n", record.file.string(), record.material, 100.0 * record.probability);
    } else {
      faults.push_back(record.fault);
    }
  }
  warn_of_faults(faults);
}

}  // namespace

void add_event_material_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      estimations.add_subcommand("event-material", "The material of a grasped piece from an event camera's file");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("events", options->files, "Files of events, a whole grasp each: rest, touch, hold and release")
      ->required();
  command->add_option("--model", options->model, "The model that `touchstone calibrate event-material` made")
      ->required();
  const auto events = add_event_options(*command);
  command->add_option("-o,--out", options->out, "The materials: a .csv file, one line a grasp")->required();
  command->callback([&action, &global, options, events] {
    action = [options, events, &global] { estimate(*options, *events, global); };
  });
}

}  // namespace touchstone::apps
