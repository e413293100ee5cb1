#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/event_options.h"
#include "apps/progress_bar.h"
#include "sensors/events/grasp_force_model_file.h"
#include "sensors/events/grasp_training.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path grasps, out;
  std::string method = "process";
  sensors::GraspForceTraining training;
};

void calibrate(const CalibrateOptions& options, const EventOptions& events, const GlobalOptions& global) {
  require_writable_place(options.out);
  sensors::GraspForceTraining training = options.training;
  training.threads = global.threads;
  if (options.method == "network") training.method = sensors::GraspForceMethod::network;
  const lab::SeenGrasps grasps = seen_grasps(options.grasps, lab::GraspNeeds::forces, events, global);
  sensors::GraspForceCalibration made;
  {
    ProgressBar bar(global.quiet);
    made = sensors::calibrate_grasp_force(grasps.seen, training, bar.listener());
  }
  sensors::save(made.model, options.out);
  fmt::print("{}: learnt from {} windows of {} grasps\n", options.out.string(), made.windows, grasps.seen.size());
  if (made.left_out == 0) return;
  fmt::print(
      "  forces of {} grasps that were left out in turn are off by {:.4f} N (RMS), {:.1f} % by at most two of the "
      "standard errors that will be stated\n",
      made.left_out, made.model.error.value().left_out_N, 100.0 * made.within_two);
}

}  // namespace

void add_event_force_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      calibrations.add_subcommand("event-force", "Learn force from an event camera's grasps whose forces are known");
  auto options = std::make_shared<CalibrateOptions>();
  command
      ->add_option(
          "--grasps", options->grasps,
          "CSV with the header events,forces,material; files are relative to its folder, forces have the header "
          "t_us,force_N; `touchstone record dvs` writes such ones")
      ->required();
  const auto events = add_event_options(*command);
  command
      ->add_option("--method", options->method, "A Gaussian 'process' of counts and time, or the published 'network'")
      ->check(CLI::IsMember({"process", "network"}))
      ->capture_default_str();
  command
      ->add_option(
          "--left-out", options->training.left_out,
          "So many grasps are each left out of a training of their own: their errors are those that are stated later")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  command->add_option("--hidden-layers", options->training.network.hidden_layers, "Of the network")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command->add_option("--units", options->training.network.units, "Of the network, in each hidden layer")
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model: a .json file")->required();
  command->callback([&action, &global, options, events] {
    action = [options, events, &global] { calibrate(*options, *events, global); };
  });
}

}  // namespace touchstone::apps
