// Light: the tracer against bare Embree, error against seconds, pictures a second, growth. A program of its own.
//   build/dev/bench/bench_light -o build/bench-results [--quick] [--date TEXT]
#include <CLI/CLI.hpp>
#include <functional>

#include "apps/blas_kind.h"
#include "bench/direct_sections.h"
#include "bench/light_sections.h"
#include "bench/machine.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "lab/run_identity.h"
#include "sim/virtual_sensor.h"

namespace {

using namespace touchstone;

void measure(const std::filesystem::path& folder, bool quick, const std::string& date) {
  std::filesystem::create_directories(folder);
  const bench::Machine machine = bench::this_machine();
  std::vector<std::string> where = {"Touchstone " + lab::program_version() + (quick ? ", quick form" : ""),
                                    describe(machine)};
  if (!date.empty()) where.push_back(date);
  if (machine.load_before > 0.25 * machine.cpus) {
    where.push_back("Others were at work on this machine: ratios hold better than seconds");
  }
  for (const std::string& line : where) fmt::print("{}\n", line);
  std::string page = "# bench/light\n\n";
  for (const std::string& line : where) page += fmt::format("- {}\n", line);
  const bench::LightOptions options{quick, sim::default_cache_folder()};
  const std::vector<std::function<bench::ResultTable(const bench::LightOptions&)>> tables = {
      bench::bare_rays_table,       bench::light_error_table,  bench::direct_frames_table, bench::hole_blur_table,
      bench::gelsight_frames_table, bench::light_growth_table, bench::device_frames_table};
  for (const auto& make : tables) {
    const bench::ResultTable table = make(options);
    write_files(table, where, folder);
    const std::string text = to_markdown(table);
    page += text;
    fmt::print("{}", text);
    std::fflush(stdout);
  }
  write_whole_file(folder / "light.md", page);
  fmt::print("\nWritten to {}\n", folder.string());
}

}  // namespace

int main(int argc, char** argv) {
  apps::choose_blas_kind(argv);
  CLI::App app("The renderers' speed and error");
  std::filesystem::path folder = "build/bench-results";
  bool quick = false;
  std::string date;
  app.add_option("-o", folder, "Where CSV, SVG and light.md go");
  app.add_flag("--quick", quick, "Under half a minute");
  app.add_option("--date", date, "What the results shall say for their date");
  CLI11_PARSE(app, argc, argv);
  try {
    measure(folder, quick, date);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_light: {}\n", error.what());
    return 1;
  }
  return 0;
}
