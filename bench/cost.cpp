// Scenes drawn at random, with and without an accuracy: the seconds predicted beside those measured. A program of its
// own, on one thread.
//   script/bench cost     or  build/dev/bench/bench_cost -o build/bench-results [--quick] [--only 19]
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "bench/report.h"
#include "core/seconds_since.h"
#include "lab/bench/cost_bench.h"

namespace touchstone::bench {
namespace {

constexpr double kAllowed = 0.3;
constexpr double kWanted = 0.9;

struct Runs {
  std::vector<lab::NeedTrial> trials;
  std::vector<lab::CostOutcome> outcomes;
};

/// Of this run alone: what is kept by others would be missing in the seconds.
struct CacheFolder {
  CacheFolder() { std::filesystem::create_directory(path); }
  ~CacheFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  CacheFolder(const CacheFolder&) = delete;
  CacheFolder& operator=(const CacheFolder&) = delete;

  std::filesystem::path path = std::filesystem::temp_directory_path() / fmt::format("touchstone-cost-{}", getpid());
};

std::string seconds(double value) {
  return fmt::format("{:.3g}", value);
}

std::string pair(const lab::CostPair& one) {
  return fmt::format("{:.3g} / {:.3g}", one.predicted_s, one.measured_s);
}

ResultTable totals_table(const Runs& runs, const std::string& name, const std::string& what,
                         const sim::MachineRates& rates, double rates_s) {
  using lab::CostOutcome;
  ResultTable table;
  table.name = "cost-totals-" + name;
  table.title = fmt::format("{} scenes {}: predicted over measured seconds", runs.outcomes.size(), what);
  table.columns = {"seconds of", "scenes", "within 30 %", "wanted", "from", "to"};
  const auto row = [&](const std::string& part, const std::string& wanted, const auto& of) {
    const lab::CostSummary sum = lab::summarise(runs.outcomes, kAllowed, of);
    table.rows.push_back({part, std::to_string(sum.scenes),
                          sum.scenes == 0 ? "-" : fmt::format("{:.0f} %", 100.0 * sum.within / sum.scenes), wanted,
                          fmt::format("{:.2f}", sum.least), fmt::format("{:.2f}", sum.most)});
  };
  row("all of it", fmt::format("at least {:.0f} %", 100.0 * kWanted), [](const CostOutcome& o) { return o.in_all(); });
  row("without the gel's set-up", "-", [](const CostOutcome& o) {
    const lab::CostPair all = o.in_all();
    return lab::CostPair{all.predicted_s - o.gel.predicted_s, all.measured_s - o.gel.measured_s};
  });
  row("the gel's set-up", "-", [](const CostOutcome& o) { return o.gel; });
  row("mechanics", "-", [](const CostOutcome& o) { return o.mechanics; });
  row("the camera's set-up", "-", [](const CostOutcome& o) { return o.camera; });
  row("pictures", "-", [](const CostOutcome& o) { return o.frames; });
  double look_s = 0.0, needs_s = 0.0;
  int failed = 0;
  for (const CostOutcome& one : runs.outcomes) {
    look_s += one.look_s;
    needs_s += one.needs_s;
    failed += one.failure.empty() ? 0 : 1;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(1, runs.outcomes.size()));
  table.remarks = {
      fmt::format("Predicting took {:.1f} s a scene; the machine's rates {:.1f} s, once.{}", look_s / n, rates_s,
                  needs_s > 0.0
                      ? fmt::format(" What effects change took {:.1f} s a scene: measured, not predicted, and "
                                    "in none of the rows.",
                                    needs_s / n)
                      : ""),
      fmt::format("Scenes that can't be simulated: {}; they are in no row.", failed),
      "One thread. Seconds are those that it worked, which are those on the clock where nobody else is at work.",
      fmt::format(
          "Rates: {:.3g} s for 1e9 operations of an elimination, {:.3g} ms for 1000 unknowns, {:.3g} s "
          "for bodies of one radius on a flat gel, {:.3g} on a dome, {:.3g} for 1e9 operations at finite strain.",
          1e9 * rates.elimination_s, 1e6 * rates.unknown_s, rates.flat_press_s, rates.curved_press_s,
          1e9 * rates.newton_s)};
  return table;
}

ResultTable all_table(const Runs& runs, const std::string& name, const std::string& what) {
  ResultTable table;
  table.name = "cost-all-" + name;
  table.title = fmt::format("All of them {}: seconds predicted / measured", what);
  table.columns = {"scene",
                   "gel",
                   "mechanics",
                   "camera",
                   "pictures",
                   "in all",
                   "predicted over measured",
                   "light as predicted",
                   "light then",
                   "finite strain",
                   "needs, s"};
  for (std::size_t k = 0; k < runs.outcomes.size(); ++k) {
    const lab::CostOutcome& one = runs.outcomes[k];
    if (!one.failure.empty()) {
      table.rows.push_back({runs.trials[k].what, one.failure, "", "", "", "", "", "", "", "", ""});
      continue;
    }
    const bool finite = std::find(one.on.begin(), one.on.end(), "finite strain") != one.on.end();
    table.rows.push_back({runs.trials[k].what, pair(one.gel), pair(one.mechanics), pair(one.camera), pair(one.frames),
                          pair(one.in_all()), fmt::format("{:.2f}", one.in_all().ratio()), one.light, one.light_then,
                          finite ? "yes" : "no", one.needs_s > 0.0 ? seconds(one.needs_s) : "-"});
  }
  return table;
}

}  // namespace
}  // namespace touchstone::bench

int main(int argc, char** argv) {
  using namespace touchstone;
  using namespace touchstone::bench;
  CLI::App app("Whether scenes take the seconds that were predicted");
  std::uint64_t seed = 1;
  int count = 0;
  int only = -1;
  bool by_shares = true, by_need = true;
  app.add_option("--seed", seed, "Of the draws (default 1)");
  app.add_option("--count", count, "Scenes (default 30, in the quick form 3)")->check(CLI::PositiveNumber);
  app.add_option("--only", only, "This scene alone")->check(CLI::NonNegativeNumber);
  app.add_flag("!--no-shares", by_shares, "Not those without an accuracy");
  app.add_flag("!--no-need", by_need, "Not those with an accuracy");
  return report_main("cost", app, argc, argv, [&](Report& report) {
    if (count == 0) count = report.quick() ? 3 : 30;
    const std::filesystem::path scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
    const CacheFolder cache;
    const auto begun = std::chrono::steady_clock::now();
    const sim::MachineRates rates = sim::measure_rates(1);
    const double rates_s = seconds_since(begun);
    lab::GelSeconds gels;
    for (const bool with_accuracy : {false, true}) {
      if (!(with_accuracy ? by_need : by_shares)) continue;
      Runs runs;
      for (int k = std::max(0, only); k < (only < 0 ? count : only + 1); ++k) {
        runs.trials.push_back(lab::need_trial(scenes, seed, k));
        runs.outcomes.push_back(lab::run_cost_trial(runs.trials.back(), with_accuracy, rates, cache.path, gels));
        const lab::CostOutcome& one = runs.outcomes.back();
        fmt::print("{}: gel {}, mechanics {}, camera {}, pictures {}, in all {}; {} ({}) {}\n", runs.trials.back().what,
                   pair(one.gel), pair(one.mechanics), pair(one.camera), pair(one.frames), pair(one.in_all()),
                   one.light, one.light_then, one.failure);
        std::fflush(stdout);
      }
      const std::string name = with_accuracy ? "need" : "shares";
      const std::string what = with_accuracy ? "with an accuracy" : "without an accuracy";
      report.take(totals_table(runs, name, what, rates, rates_s));
      report.take(all_table(runs, name, what));
    }
  });
}
