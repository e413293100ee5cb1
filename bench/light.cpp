// Light: the tracer against bare Embree, error against seconds, pictures a second, growth, what each effect costs. A
// program of its own.
//   script/bench light      or  build/dev/bench/bench_light -o build/bench-results [--quick] [--only effects]
#include <algorithm>

#include "bench/coated_sections.h"
#include "bench/direct_sections.h"
#include "bench/light_sections.h"
#include "bench/report.h"
#include "sim/press/gel_setup.h"

int main(int argc, char** argv) {
  using namespace touchstone;
  using namespace touchstone::bench;
  const std::vector<std::pair<std::string, ResultTable (*)(const LightOptions&)>> tables = {
      {"rays", bare_rays_table},         {"error", light_error_table},        {"frames", direct_frames_table},
      {"blur", hole_blur_table},         {"gelsight", gelsight_frames_table}, {"growth", light_growth_table},
      {"effects", light_effects_table},  {"devices", device_frames_table},    {"coated", coated_error_table},
      {"coated-time", coated_time_table}};
  std::vector<std::string> names;
  for (const auto& [name, make] : tables) names.push_back(name);
  CLI::App app("The renderers' speed and error");
  std::vector<std::string> only;
  app.add_option("--only", only, "These tables")->check(CLI::IsMember(names));
  return report_main("light", app, argc, argv, [&](Report& report) {
    const LightOptions options{report.quick(), sim::default_cache_folder()};
    for (const auto& [name, make] : tables) {
      if (only.empty() || std::find(only.begin(), only.end(), name) != only.end()) report.take(make(options));
    }
  });
}
