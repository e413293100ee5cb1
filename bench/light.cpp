// Light: the tracer against bare Embree, error against seconds, pictures a second, growth, what each effect costs. A
// program of its own.
//   script/bench light      or  build/dev/bench/bench_light -o build/bench-results [--quick] [--date TEXT]
#include "bench/light_sections.h"
#include "bench/report.h"
#include "sim/virtual_sensor.h"

int main(int argc, char** argv) {
  using namespace touchstone;
  using namespace touchstone::bench;
  CLI::App app("The renderers' speed and error");
  return report_main("light", app, argc, argv, [](Report& report) {
    const LightOptions options{report.quick(), sim::default_cache_folder()};
    for (const auto& table : {bare_rays_table, light_error_table, direct_frames_table, light_growth_table,
                              light_effects_table, device_frames_table}) {
      report.take(table(options));
    }
  });
}
