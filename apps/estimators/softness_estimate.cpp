#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "lab/vhs/softness_table.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model, out;
  std::vector<std::filesystem::path> files;
};

void estimate(const EstimateOptions& options, const GlobalOptions& global) {
  require_writable_place(options.out);
  const sensors::SoftnessModel model = sensors::load_softness_model(options.model);
  std::vector<lab::SoftnessRecord> records;
  {
    ProgressBar bar(global.quiet);
    records = lab::write_softness(model, options.files, options.out, bar.listener());
  }
  std::vector<std::string> faults;
  for (const lab::SoftnessRecord& record : records) {
    if (record.fault.empty()) {
      fmt::print("{}: {} ({:.1f} %)\n", record.file.string(), record.softness, 100.0 * record.probability);
    } else {
      faults.push_back(record.fault);
    }
  }
  warn_of_faults(faults);
}

}  // namespace

void add_softness_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand("softness", "How soft pressed pieces are, from forces over time");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("forces", options->files, "Files with the header t_us,force_N, a press each")->required();
  command->add_option("--model", options->model, "The model that `touchstone calibrate softness` made")->required();
  command->add_option("-o,--out", options->out, "The levels: a .csv file, one line a press")->required();
  command->callback([&action, options, &global] { action = [options, &global] { estimate(*options, global); }; });
}

}  // namespace touchstone::apps
