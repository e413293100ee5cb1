#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/event_options.h"
#include "apps/progress_bar.h"
#include "lab/dvs/grasp_estimates.h"
#include "sensors/events/grasp_force_model_file.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model, out;
  std::vector<std::filesystem::path> files;
};

void estimate(const EstimateOptions& options, const EventOptions& events, const GlobalOptions& global) {
  const sensors::GraspForceModel model = sensors::load_grasp_force_model(options.model);
  std::vector<lab::GraspForceRecord> records;
  {
    ProgressBar bar(global.quiet);
    records = lab::write_grasp_forces(model, options.files, read_options(events), options.out, bar.listener());
  }
  for (const lab::GraspForceRecord& record : records) {
    const std::string name = record.file.string();
    if (!record.fault.empty()) {
      spdlog::warn("{}: {}", record.fault, record.windows > 0 ? "windows before that are kept" : "left out");
    }
    if (record.flicker.found()) {
      spdlog::warn(
          "{}: before the touch {:.0f} % of the events keep time with lamps at {:.0f} Hz: forces may be anything", name,
          100.0 * record.flicker.share, record.flicker.frequency_Hz);
    }
    if (record.windows == 0) continue;
    fmt::print("{}: {} windows, {} of them in touch; up to {:.3f} N{}\n", name, record.windows, record.touched,
               record.largest_N,
               record.extrapolated > 0 ? fmt::format("; {} beyond what the model has seen", record.extrapolated) : "");
  }
}

}  // namespace

void add_event_force_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      estimations.add_subcommand("event-force", "Force of each 7 ms of a grasp from an event camera's file");
  auto options = std::make_shared<EstimateOptions>();
  command
      ->add_option(
          "events", options->files,
          "Files of events, a grasp each: text, HDF5 as of DSEC, EVT 3.0 or AEDAT 4.0; the scene is at rest for "
          "the first 140 ms")
      ->required();
  command->add_option("--model", options->model, "The model that `touchstone calibrate event-force` made")->required();
  const auto events = add_event_options(*command);
  command->add_option("-o,--out", options->out, "The folder of the forces: a .csv file for each of events")->required();
  command->callback([&action, &global, options, events] {
    action = [options, events, &global] { estimate(*options, *events, global); };
  });
}

}  // namespace touchstone::apps
