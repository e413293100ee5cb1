#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/reflex_options.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "lab/reflex/register_table.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model, out;
  sensors::ReflexSettings loop;
};

std::string error_text(const std::optional<double>& rms_N) {
  return rms_N ? fmt::format("; off by {:.4f} N (RMS)", *rms_N) : "";
}

void estimate_registers(const EstimateOptions& options, const ReflexOptions& chip, const GlobalOptions& global) {
  const sensors::ReflexModel model = sensors::load_reflex_model(options.model);
  std::vector<lab::RegisterRecord> records;
  {
    ProgressBar bar(global.quiet);
    records = lab::write_register_forces(model, chip.registers, options.loop, options.out, bar.listener());
  }
  std::vector<std::string> faults;
  for (const lab::RegisterRecord& record : records) {
    if (!record.fault.empty()) {
      faults.push_back(record.fault);
      continue;
    }
    fmt::print("{}: {} frames, force in {}, up to {:.3f} N{}{}{}\n", record.file.string(), record.frames,
               record.in_contact, record.largest_N, error_text(record.rms_N),
               record.stop_us ? fmt::format("; stops at {} us", *record.stop_us) : "",
               record.faulty > 0 ? fmt::format("; {} frames can't be believed", record.faulty) : "");
  }
  warn_of_faults(faults);
}

void estimate_pictures(const EstimateOptions& options, const ReflexOptions& chip, const GlobalOptions& global) {
  const sensors::ExploreModel model = sensors::load_explore_model(options.model);
  lab::ExploreSummary summary;
  {
    ProgressBar bar(global.quiet);
    summary =
        lab::write_explore_forces(model, picture_streams(chip), picture_settings(chip), options.out, bar.listener());
  }
  warn_of_faults(summary.faults);
  warn_of_notes(*chip.frames);
  fmt::print("{}: forces of {} pictures, {} of them against rest, {} step by step; up to {:.3f} N{}\n",
             options.out.string(), summary.absolute + summary.relative, summary.absolute, summary.relative,
             summary.largest_N, error_text(summary.rms_N));
}

}  // namespace

void add_reflex_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand(
      "reflex", "Contact, force and shear of a fingertip on a motion chip, of its registers or of pictures of dots");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The model that `touchstone calibrate reflex` made")->required();
  const auto chip = add_reflex_options(*command, {.forces = true});
  command
      ->add_option("--stop-above-N", options->loop.stop_above_N,
                   "Of --registers: `stop` is 1 from a frame with more force on; 0: with any that is seen")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The forces: a .csv file, one line a frame")->required();
  command->callback([&action, &global, options, chip] {
    action = [options, chip, &global] {
      require_writable_place(options->out);
      if (has_pictures(*chip)) {
        estimate_pictures(*options, *chip, global);
      } else {
        estimate_registers(*options, *chip, global);
      }
    };
  });
}

}  // namespace touchstone::apps
