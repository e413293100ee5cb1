#include <fmt/format.h>

#include <memory>
#include <optional>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "datasets/sets/generate.h"

namespace touchstone::apps {
namespace {

struct Options {
  std::filesystem::path job;
  std::filesystem::path out;
  std::optional<int> missing;
};

void merge(const Options& options, const GlobalOptions& global) {
  if (options.missing) {
    fmt::print("{}\n", fmt::join(datasets::missing_shards(options.job, options.out, *options.missing), ","));
    return;
  }
  datasets::GenerateReport report;
  {
    ProgressBar bar(global.quiet);
    report = datasets::merge(options.job, options.out, bar.listener());
  }
  if (report.was_finished) {
    print_finished(options.out, report.samples);
    return;
  }
  fmt::print("{}: {} samples\n", options.out.string(), report.samples);
}

}  // namespace

void add_merge_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      app.add_subcommand("merge", "Check that all shards of a data set are there, and write its card and manifest");
  auto options = std::make_shared<Options>();
  command->add_option("JOB", options->job, "Job file, as given to generate")->required();
  command->add_option("-o,--out", options->out, "Folder of the data set")->required();
  command->add_option("--missing,--lacking", options->missing,
                      "N: merge nothing, but print which of N shards aren't there yet, as 2,5,7");
  command->callback([&action, &global, options] { action = [options, &global] { merge(*options, global); }; });
}

}  // namespace touchstone::apps
