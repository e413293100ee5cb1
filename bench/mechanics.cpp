// Work against precision of the mechanics, speed, growth, and GetFEM beside us. Sweeps, so a program of its own.
//   script/bench            or  build/dev/bench/bench_mechanics -o build/bench-results
#include "bench/mechanics_sections.h"
#include "bench/peer_process.h"
#include "bench/report.h"

int main(int argc, char** argv) {
  using namespace touchstone::bench;
  CLI::App app("Work against precision of the mechanics, its speed and growth, and GetFEM beside it");
  bool no_peer = false;
  app.add_flag("--no-peer", no_peer, "Leave GetFEM out");
  return report_main("mechanics", app, argc, argv, [&](Report& report) {
    const ScratchFolder scratch;
    const BenchOptions options{report.quick(), scratch.path()};
    {
      const std::vector<LadderStep> ladder = make_ladder(options);
      report.take(mesh_table(ladder));
      report.take(tolerance_table(ladder[report.quick() ? 0 : 3]));
      if (!no_peer) report.take(peer_table(ladder, options));
    }  // its memory is given back before that of other gels is measured
    // Whatever else scales with the surface gets its table here.
    for (const auto& table : {throughput_table, growth_table, pixel_growth_table}) report.take(table(options));
  });
}
