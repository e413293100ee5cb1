#include <unistd.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/jobs/scenes_folder.h"
#include "datasets/sets/processor.h"
#include "datasets/sets/run_identity.h"
#include "lab/studies/study.h"
#include "lab/validation/validation.h"
#include "lab/validation/validation_page.h"

namespace touchstone::apps {
namespace {

struct Options {
  std::vector<std::string> groups;
  bool quick = false;
  std::filesystem::path json;
  std::filesystem::path page;
  std::filesystem::path out;
  std::string date;
};

/// A folder of this run's own, removed at its end.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "touchstone-validate-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) fail("{}: can't be made", name);
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void validate(Options options, const GlobalOptions& global) {
  if (!options.out.empty()) {
    lab::make_study_folder(options.out);
    if (options.json.empty()) options.json = options.out / "validation.json";
    if (options.page.empty()) options.page = options.out / "validation.html";
  }
  if (!options.json.empty()) require_writable_place(options.json);
  std::filesystem::path markdown = options.page;
  if (!options.page.empty()) {
    if (options.page.extension() != ".html") {
      fail("--page is '{}'; its name must end with .html (the Markdown form is put beside it)", options.page.string());
    }
    markdown.replace_extension(".md");
    require_writable_place(options.page);
    require_writable_place(markdown);
  } else if (!options.date.empty()) {
    fail("--date '{}' is for the page: give -o or --page too", options.date);
  }
  const Scratch scratch;
  lab::ValidateOptions how;
  how.quick = options.quick;
  how.cache = global.cache;
  how.scenes = datasets::scenes_folder();
  how.scratch = scratch.path();
  std::vector<lab::ValidationRow> rows;
  {
    ProgressBar bar(global.quiet);
    how.progress = bar.listener();
    rows = lab::validate(options.groups, lab::validation_groups(), how);
  }
  if (!options.json.empty()) write_whole_file(options.json, lab::to_json(rows));
  if (!options.page.empty()) {
    const lab::PageHeader header{datasets::program_version(), datasets::processor_kind(), options.date};
    write_whole_file(options.page, lab::to_html(rows, header));
    write_whole_file(markdown, lab::to_markdown(rows, header));
  }
  fmt::print("{}", lab::to_table(rows));
  const auto missed = std::count_if(rows.begin(), rows.end(), [](const lab::ValidationRow& row) { return !row.holds; });
  fmt::print("{} of {} rows hold\n", rows.size() - static_cast<std::size_t>(missed), rows.size());
}

}  // namespace

void add_validate_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command = app.add_subcommand(
      "validate", "Compare the simulator and its estimators with closed forms and published figures");
  auto options = std::make_shared<Options>();
  std::string known = "all";
  for (const lab::ValidationGroup& group : lab::validation_groups()) known += ", " + group.name;
  options->groups = {"all"};
  command->add_option("GROUP", options->groups, "What: " + known);
  command->add_flag("--quick", options->quick, "Coarser or fewer cases: minutes");
  command->add_option("-o,--out", options->out,
                      "Folder for validation.html, validation.md and validation.json; is made");
  command->add_option("--json", options->json, "Write the rows to this file");
  command->add_option("--page", options->page, "Write a page for people, FILE.html, and FILE.md beside it");
  command->add_option("--date", options->date, "What the page shall say for its date");
  command->callback([&action, &global, options] { action = [options, &global] { validate(*options, global); }; });
}

}  // namespace touchstone::apps
