#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "lab/studies/study.h"

namespace touchstone::apps {
namespace {

void study(const std::filesystem::path& file, const std::filesystem::path& out, const GlobalOptions& global) {
  const lab::StudySpec spec = lab::read_study(file);
  lab::make_study_folder(out);  // before minutes of work that couldn't be kept
  lab::StudyResult result;
  {
    ProgressBar bar(global.quiet);
    result = lab::run_study(spec, global.cache, bar.listener());
  }
  for (const std::string& note : result.notes) spdlog::warn("{}", note);
  lab::write_study(result, out);
  for (const lab::StudyFile& written : result.files) fmt::print("{}\n", (out / written.name).string());
}

}  // namespace

void add_study_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand("study", "Vary a device's figures and table what comes of it");
  auto file = std::make_shared<std::filesystem::path>();
  auto out = std::make_shared<std::filesystem::path>();
  command->add_option("STUDY", *file, "Study file")->required();
  command->add_option("-o,--out", *out, "Folder for its tables and plots; is made")->required();
  command->callback([&action, &global, file, out] { action = [&global, file, out] { study(*file, *out, global); }; });
}

}  // namespace touchstone::apps
