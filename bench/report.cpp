#include "bench/report.h"

#include <fmt/format.h>

#include "apps/blas_kind.h"
#include "bench/machine.h"
#include "core/whole_file.h"
#include "datasets/sets/run_identity.h"

namespace touchstone::bench {

Report::Report(std::string name, std::filesystem::path folder, bool quick, const std::string& date)
    : name_(std::move(name)), folder_(std::move(folder)), quick_(quick) {
  std::filesystem::create_directories(folder_);
  const Machine machine = this_machine();
  where_ = {"Touchstone " + datasets::program_version() + (quick ? ", quick form" : ""), describe(machine)};
  if (!date.empty()) where_.push_back(date);
  if (machine.load_before > 0.25 * machine.cpus) {
    where_.push_back("Others were at work on this machine: ratios hold better than seconds");
  }
  page_ = fmt::format("# bench/{}\n\n", name_);
  for (const std::string& line : where_) {
    fmt::print("{}\n", line);
    page_ += fmt::format("- {}\n", line);
  }
  std::fflush(stdout);
}

void Report::keep(const ResultTable& table) const {
  write_files(table, where_, folder_);
}

void Report::take(const ResultTable& table) {
  keep(table);
  const std::string text = to_markdown(table);
  page_ += text;
  fmt::print("{}", text);
  std::fflush(stdout);
}

void Report::finish() const {
  write_whole_file(folder_ / (name_ + ".md"), page_);
  fmt::print("\nWritten to {}\n", folder_.string());
}

int report_main(const std::string& name, CLI::App& app, int argc, char** argv,
                const std::function<void(Report&)>& measure) {
  apps::choose_blas_kind(argv);
  std::filesystem::path folder = "build/bench-results";
  bool quick = false;
  std::string date;
  app.add_option("-o", folder, fmt::format("Where CSV, SVG and {}.md go", name));
  app.add_flag("--quick", quick, "Under half a minute");
  app.add_option("--date", date, "What the results shall say for their date");
  CLI11_PARSE(app, argc, argv);
  try {
    Report report(name, folder, quick, date);
    measure(report);
    report.finish();
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_{}: {}\n", name, error.what());
    return 1;
  }
  return 0;
}

}  // namespace touchstone::bench
