// Work against precision of the mechanics, speed, growth, and GetFEM beside us. Sweeps, so a program of its own.
//   script/bench            or  build/dev/bench/bench_mechanics -o build/bench-results
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <functional>

#include "apps/blas_kind.h"
#include "bench/machine.h"
#include "bench/mechanics_sections.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "lab/run_identity.h"

namespace {

using namespace touchstone;
using bench::ResultTable;

/// Removed at the end of the run.
class ScratchFolder {
 public:
  ScratchFolder() : path_(std::filesystem::temp_directory_path() / fmt::format("touchstone-bench-{}", getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void measure(const std::filesystem::path& folder, bool quick, bool peer, const std::string& date) {
  std::filesystem::create_directories(folder);
  const bench::Machine machine = bench::this_machine();
  std::vector<std::string> where = {"Touchstone " + lab::program_version() + (quick ? ", quick form" : ""),
                                    describe(machine)};
  if (!date.empty()) where.push_back(date);
  if (machine.load_before > 0.25 * machine.cpus) {
    where.push_back("Others were at work on this machine: ratios hold better than seconds");
  }
  for (const std::string& line : where) fmt::print("{}\n", line);
  const ScratchFolder scratch;
  const bench::BenchOptions options{quick, scratch.path()};
  std::string page = "# bench/mechanics\n\n";
  for (const std::string& line : where) page += fmt::format("- {}\n", line);
  const auto take = [&](const ResultTable& table) {
    write_files(table, where, folder);
    const std::string text = to_markdown(table);
    page += text;
    fmt::print("{}", text);
    std::fflush(stdout);
  };
  {
    const std::vector<bench::LadderStep> ladder = bench::make_ladder(options);
    take(mesh_table(ladder));
    take(tolerance_table(ladder[quick ? 0 : 3]));
    if (peer) take(peer_table(ladder, options));
  }  // its memory is given back before that of other gels is measured
  // Whatever else scales with the surface gets its table here.
  const std::vector<std::function<ResultTable(const bench::BenchOptions&)>> scaling = {
      bench::throughput_table, bench::growth_table, bench::pixel_growth_table};
  for (const auto& table : scaling) take(table(options));
  write_whole_file(folder / "mechanics.md", page);
  fmt::print("\nWritten to {}\n", folder.string());
}

}  // namespace

int main(int argc, char** argv) {
  apps::choose_blas_kind(argv);
  CLI::App app("Work against precision of the mechanics, its speed and growth, and GetFEM beside it");
  std::filesystem::path folder = "build/bench-results";
  bool quick = false;
  bool no_peer = false;
  std::string date;
  app.add_option("-o", folder, "Where CSV, SVG and mechanics.md go");
  app.add_flag("--quick", quick, "Under half a minute");
  app.add_flag("--no-peer", no_peer, "Leave GetFEM out");
  app.add_option("--date", date, "What the results shall say for their date");
  CLI11_PARSE(app, argc, argv);
  try {
    measure(folder, quick, !no_peer, date);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_mechanics: {}\n", error.what());
    return 1;
  }
  return 0;
}
