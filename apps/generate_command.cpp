#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "lab/dataset.h"

namespace touchstone::apps {
namespace {

struct Options {
  std::filesystem::path job;
  std::filesystem::path out;
  bool no_timings = false;
};

void generate(const Options& options, const GlobalOptions& global) {
  lab::GenerateOptions how;
  how.source = lab::simulator(global.cache);
  how.threads = global.threads;
  how.timings = !options.no_timings;
  lab::GenerateReport report;
  {
    ProgressBar bar(global.quiet);
    report = lab::generate(options.job, options.out, how, bar.listener());
  }
  if (!report.warning.empty()) spdlog::warn("{}", report.warning);
  if (report.was_finished) {
    fmt::print("{}: is finished already; all of its checksums hold ({} samples)\n", options.out.string(),
               report.samples);
    return;
  }
  fmt::print("{}: {} samples, {} of them rendered", options.out.string(), report.samples, report.rendered);
  if (report.kept > 0) fmt::print(", {} kept from a run that was broken off", report.kept);
  fmt::print("\n");
}

}  // namespace

void add_generate_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      app.add_subcommand("generate", "Make a labelled data set; the same command goes on with one that was broken off");
  auto options = std::make_shared<Options>();
  command->add_option("JOB", options->job, "Job file")->required();
  command->add_option("-o,--out", options->out, "Folder of the data set: new, empty, or this job's own")->required();
  command->add_flag("--no-timings", options->no_timings,
                    "Leave wall times out of dataset.json: then the whole folder is the same bytes in every run");
  command->callback([&action, &global, options] { action = [options, &global] { generate(*options, global); }; });
}

}  // namespace touchstone::apps
