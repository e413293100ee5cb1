// Blender's Cycles beside our path tracer on the same scenes: equal pictures, and the time of each. A program of its
// own.
//   script/bench light-peer or  build/dev/bench/bench_light_peer -o build/bench-results [--quick] [--date TEXT]
#include "bench/cycles_peer.h"
#include "bench/light_peer_sections.h"
#include "bench/peer_process.h"
#include "bench/report.h"
#include "core/error.h"

int main(int argc, char** argv) {
  using namespace touchstone;
  using namespace touchstone::bench;
  CLI::App app("Blender's Cycles beside the path tracer");
  return report_main("light-peer", app, argc, argv, [](Report& report) {
    if (const std::string why = why_no_cycles(); !why.empty()) fail("nothing to measure against: {}", why);
    const ScratchFolder scratch;
    const LightPeerOptions options{report.quick(), scratch.path()};
    report.take(equal_pictures_table(options));
    report.take(equal_noise_table(options));
  });
}
