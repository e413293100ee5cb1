#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "lab/vhs/softness_table.h"

namespace touchstone::apps {
namespace {

struct CalibrateOptions {
  std::filesystem::path presses, out;
  double rate_Hz = 0.0;
  sensors::SoftnessTraining training = sensors::usual_softness_training();
};

void calibrate(const CalibrateOptions& options, const GlobalOptions& global) {
  require_writable_place(options.out);
  const lab::KnownSoftnessFiles known = lab::read_softness_table(options.presses, options.rate_Hz);
  const sensors::SoftnessCalibration made =
      sensors::calibrate_softness(known.presses, known.rate_Hz, options.training, global.threads);
  sensors::save(made.model, options.out);
  warn_of_faults(known.faults);
  fmt::print("{}: learnt from {} presses of {} levels, {:.4g} forces a second\n", options.out.string(),
             known.presses.size(), made.model.networks.front().materials.size(), known.rate_Hz);
  fmt::print("  of presses that were left out in turn {:.1f} % are named right\n",
             100.0 * made.right / static_cast<double>(known.presses.size()));
}

}  // namespace

void add_softness_calibration(CLI::App& calibrations, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      calibrations.add_subcommand("softness", "Learn levels of softness from the forces of presses over time");
  auto options = std::make_shared<CalibrateOptions>();
  command
      ->add_option("--presses", options->presses,
                   "CSV with the header forces,softness; files are relative to its folder and have the header "
                   "t_us,force_N; each begins before the touch")
      ->required();
  command->add_option("--rate", options->rate_Hz, "Forces a second, in place of the first file's")
      ->check(CLI::Range(1.0, 1e6));
  command
      ->add_option("--trigger-N", options->training.spectrogram.trigger_N,
                   "A press begins where its force first stays above this: above the noise")
      ->check(CLI::Range(1e-6, 1e3))
      ->capture_default_str();
  command->add_option("--seconds", options->training.spectrogram.length_s, "How much of a press is looked at, s")
      ->check(CLI::Range(0.064, 60.0))
      ->capture_default_str();
  command->add_option("--highest-Hz", options->training.highest_Hz, "Frequencies above are left out; 0: none")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->add_option("--units", options->training.classifier.units, "Of the networks' one hidden layer")
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  command->add_option("--networks", options->training.networks, "Whose answers are averaged")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The model: a .json file")->required();
  command->callback([&action, options, &global] { action = [options, &global] { calibrate(*options, global); }; });
}

}  // namespace touchstone::apps
