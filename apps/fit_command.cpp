#include <spdlog/spdlog.h>
#include <unistd.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "lab/fit/unit_fit.h"

namespace touchstone::apps {
namespace {

void print(const lab::FittedUnknown& unknown) {
  if (unknown.identified) {
    fmt::print("{}: {:.5g} -> {:.5g}, 95 % from {:.5g} to {:.5g}{}\n", unknown.name, unknown.start, unknown.value,
               unknown.low95, unknown.high95, unknown.at_end ? "; at the end of its allowed range" : "");
  } else {
    fmt::print("{}: {:.5g} -> {:.5g}, but not identified by the data\n", unknown.name, unknown.start, unknown.value);
  }
}

/// Of what is known beforehand: how many steps it will take isn't.
void print_plan(const lab::FitPlan& plan) {
  if (isatty(STDERR_FILENO) == 1) fmt::print(stderr, "\r\x1b[K");  // in the place of the bar
  if (plan.step_s > 0.0) {
    fmt::print(stderr, "a step takes some {}, {} steps at most; then {} for the intervals\n",
               duration_text(plan.step_s), plan.most_steps, duration_text(plan.last_s));
  } else {
    fmt::print(stderr, "takes some {} more\n", duration_text(plan.last_s));
  }
}

void fit(const std::filesystem::path& file, const std::filesystem::path& out, const GlobalOptions& global) {
  lab::UnitFitRun run;
  {
    ProgressBar bar(global.quiet);
    run = lab::run_unit_fit(file, out, global.cache, bar.listener(), global.quiet ? nullptr : print_plan);
  }
  if (run.was_finished) {
    fmt::print("{}: holds this fit, finished\n", out.string());
    return;
  }
  if (run.gone_on_from) fmt::print("went on behind step {} of a run that was broken off\n", *run.gone_on_from);
  const lab::UnitFit& result = run.fit;
  for (const lab::FittedUnknown& unknown : result.unknowns) print(unknown);
  for (const lab::UnidentifiableCombination& combination : result.unidentified)
    fmt::print("not identified: {}\n", combination.words);
  fmt::print("misfit {:.2f} -> {:.2f} of the noise\n", result.misfit_before, result.misfit_after);
  for (const std::string& doubt : result.doubts) spdlog::warn("{}", doubt);
  fmt::print("{}: the fitted device, the report and its pictures\n", out.string());
}

}  // namespace

void add_fit_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand(
      "fit",
      "Find the numbers of a device's file with which it shows and feels what a real sensor's presses did; the same "
      "command goes on with a fit that was broken off");
  auto file = std::make_shared<std::filesystem::path>();
  auto out = std::make_shared<std::filesystem::path>();
  command->add_option("FIT", *file, "Fit file: device, unknowns and recorded presses (docs/calibration.md)")
      ->required();
  command->add_option("-o,--out", *out, "Folder for the fitted device and the report; is made")->required();
  command->callback([&action, &global, file, out] { action = [&global, file, out] { fit(*file, *out, global); }; });
}

}  // namespace touchstone::apps
