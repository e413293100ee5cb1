#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "datasets/exports/webdataset.h"

namespace touchstone::apps {
namespace {

struct Options {
  std::filesystem::path folder;
  std::filesystem::path out;
  datasets::WebDatasetOptions how;
};

void export_set(const Options& options, const GlobalOptions& global) {
  datasets::WebDatasetOptions how = options.how;
  how.threads = global.threads;
  datasets::WebDatasetReport report;
  {
    ProgressBar bar(global.quiet);
    report = datasets::export_webdataset(options.folder, options.out, how, bar.listener());
  }
  constexpr double kBytesPerMB = 1e6;
  fmt::print("{}: {} samples in {} tars, {:.1f} MB\n", options.out.string(), report.samples, report.tars,
             static_cast<double>(report.bytes) / kBytesPerMB);
}

}  // namespace

void add_webdataset_export(CLI::App& exports, const GlobalOptions& global, Action& action) {
  CLI::App* command = exports.add_subcommand("webdataset", "A data set that was drawn as tars for WebDataset");
  auto options = std::make_shared<Options>();
  command->add_option("DIR", options->folder, "Folder of the finished data set")->required();
  command->add_option("-o,--out", options->out, "Folder of the tars: new or empty")->required();
  command->add_option("--split", options->how.splits, "train, validate or test; may be given several times")
      ->take_all();
  command->add_option("--samples-per-tar", options->how.samples_per_tar, "At most so many (default 1000)");
  command->callback([&action, &global, options] { action = [&global, options] { export_set(*options, global); }; });
}

}  // namespace touchstone::apps
