// Scenes drawn at random, planned by need and looked at closely: does the plan leave out what may be left out, and is
// what it switches on worth it? A program of its own.
//   script/bench needs     or  build/dev/bench/bench_needs -o build/bench-results [--quick] [--only 19]
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "bench/report.h"
#include "lab/bench/need_bench.h"

namespace touchstone::bench {
namespace {

constexpr double kWantedOut = 0.95;
constexpr double kWantedOn = 0.8;

struct Looks {
  std::vector<lab::NeedTrial> trials;
  std::vector<lab::NeedRun> runs;
};

std::string share(int part, int all) {
  return all == 0 ? "-" : fmt::format("{:.0f} % of {}", 100.0 * part / all, all);
}

/// As it goes: the page comes at the end.
void print(const lab::NeedTrial& trial, const lab::NeedRun& run) {
  fmt::print("{}: {:.0f} s, closely {:.0f} s {}\n", trial.what, run.plan_s, run.close_s, run.failure);
  for (const lab::NeedOutcome& one : run.effects) {
    fmt::print("  {} {}: {:.2g}, closely {:.2g} {}\n", one.effect, one.on ? "on" : "off", one.planned, one.closely,
               one.note);
  }
  std::fflush(stdout);
}

ResultTable totals_table(const Looks& looks) {
  const lab::NeedSummary sum = lab::summarise(looks.runs);
  ResultTable table;
  table.name = "needs-totals";
  table.title = fmt::format("{} scenes: what is wanted and what there is", looks.runs.size());
  table.columns = {"figure", "wanted", "measured"};
  table.rows.push_back({"effects left out that change less than is allowed",
                        fmt::format("at least {:.0f} %", 100.0 * kWantedOut), share(sum.rightly_out, sum.left_out)});
  table.rows.push_back({"effects switched on that change more than a third of it",
                        fmt::format("at least {:.0f} %", 100.0 * kWantedOn), share(sum.rightly_on, sum.switched_on)});
  table.rows.push_back({"effects that couldn't be measured", "-", std::to_string(sum.not_measured)});
  double plan_s = 0.0, close_s = 0.0;
  for (const lab::NeedRun& run : looks.runs) {
    plan_s += run.plan_s;
    close_s += run.close_s;
  }
  const auto failed =
      std::count_if(looks.runs.begin(), looks.runs.end(), [](const auto& run) { return !run.failure.empty(); });
  table.rows.push_back({"scenes that can't be simulated", "0", std::to_string(failed)});
  const auto n = static_cast<double>(looks.runs.size());
  table.remarks = {
      fmt::format("A scene's needs took {:.1f} s, the closer look {:.1f} s (means, on the clock).", plan_s / n,
                  close_s / n),
      "Allowed are 1 % of a force, 1 of the imager's noise in a pixel, 0.05 pixels of a marker and 5 um of height: the "
      "defaults of `accuracy`. The closer look has the device's own mesh for finite strain, and ten times the pixels "
      "with four times the paths."};
  return table;
}

ResultTable effects_table(const Looks& looks) {
  ResultTable table;
  table.name = "needs-effects";
  table.title = "By effect";
  table.columns = {"effect", "scenes", "left out", "of these rightly", "switched on", "of these rightly"};
  std::vector<std::string> names;
  for (const lab::NeedRun& run : looks.runs) {
    for (const lab::NeedOutcome& one : run.effects) {
      if (std::find(names.begin(), names.end(), one.effect) == names.end()) names.push_back(one.effect);
    }
  }
  for (const std::string& name : names) {
    std::vector<lab::NeedRun> its;
    for (const lab::NeedRun& run : looks.runs) {
      lab::NeedRun part;
      for (const lab::NeedOutcome& one : run.effects) {
        if (one.effect == name) part.effects.push_back(one);
      }
      its.push_back(std::move(part));
    }
    const lab::NeedSummary sum = lab::summarise(its);
    table.rows.push_back({name, std::to_string(sum.left_out + sum.switched_on), std::to_string(sum.left_out),
                          std::to_string(sum.rightly_out), std::to_string(sum.switched_on),
                          std::to_string(sum.rightly_on)});
  }
  return table;
}

ResultTable all_table(const Looks& looks) {
  ResultTable table;
  table.name = "needs-all";
  table.title = "All of them";
  table.columns = {"scene", "effect", "on", "as planned, of what is allowed", "closely"};
  for (std::size_t k = 0; k < looks.runs.size(); ++k) {
    const std::string& what = looks.trials[k].what;
    if (!looks.runs[k].failure.empty()) table.rows.push_back({what, looks.runs[k].failure, "", "", ""});
    for (const lab::NeedOutcome& one : looks.runs[k].effects) {
      table.rows.push_back({what, one.effect, one.on ? "yes" : "no",
                            one.note.empty() ? fmt::format("{:.2g}", one.planned) : one.note,
                            one.note.empty() ? fmt::format("{:.2g}", one.closely) : ""});
    }
  }
  return table;
}

}  // namespace
}  // namespace touchstone::bench

int main(int argc, char** argv) {
  using namespace touchstone;
  using namespace touchstone::bench;
  CLI::App app("Whether the plan of a scene by need is right");
  std::uint64_t seed = 1;
  int count = 0;
  int only = -1;
  std::filesystem::path cache;
  app.add_option("--seed", seed, "Of the draws (default 1)");
  app.add_option("--count", count, "Scenes (default 30, in the quick form 4)")->check(CLI::PositiveNumber);
  app.add_option("--only", only, "This scene alone")->check(CLI::NonNegativeNumber);
  app.add_option("--cache", cache, "Where gels are kept between runs (default: nowhere)");
  return report_main("needs", app, argc, argv, [&](Report& report) {
    Looks looks;
    if (count == 0) count = report.quick() ? 4 : 30;
    const std::filesystem::path scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
    for (int k = std::max(0, only); k < (only < 0 ? count : only + 1); ++k) {
      looks.trials.push_back(lab::need_trial(scenes, seed, k));
      looks.runs.push_back(lab::run_need_trial(looks.trials.back(), {}, sim::kCloseLook, cache));
      print(looks.trials.back(), looks.runs.back());
    }
    report.take(totals_table(looks));
    report.take(effects_table(looks));
    report.take(all_table(looks));
  });
}
