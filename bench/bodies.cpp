// Bodies made by code, pressed on gels at lucky and unlucky places, against a mesh with 0.35 of the edges: how far
// forces and depths are off and whether the error bars say so. A program of its own.
//   script/bench bodies     or  build/dev/bench/bench_bodies -o build/bench-results [--quick] [--only 19]
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include "bench/report.h"
#include "bench/stopwatch.h"
#include "lab/bench/body_bench.h"

namespace touchstone::bench {
namespace {

constexpr double kWantedWithin = 0.95;
constexpr double kWantedMedian = 0.01;
constexpr std::size_t kWorst = 10;

struct Presses {
  std::vector<lab::TrialGel> gels;
  std::vector<lab::BodyTrial> trials;
  std::vector<lab::TrialOutcome> outcomes;
};

/// Outcomes that go together.
struct Group {
  std::string name;
  std::function<bool(const lab::BodyTrial&, const lab::TrialOutcome&)> has;
};

std::string percent(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f}", 100.0 * value) : "-";
}

std::vector<std::string> error_cells(const lab::TrialSummary& sum) {
  if (sum.count == 0) return {"-", "-", "-", "-"};
  return {percent(sum.median), percent(sum.percentile95), fmt::format("{:+.2f}", 100.0 * sum.middle),
          fmt::format("{:.0f}", 100.0 * sum.within)};
}

ResultTable group_table(const Presses& presses, const std::string& name, const std::string& title,
                        const std::vector<Group>& groups) {
  ResultTable table;
  table.name = "bodies-" + name;
  table.title = title;
  table.columns = {"what", "bodies", "failed", "untouched"};
  for (const char* figure : {"force", "depth", "shear"}) {
    for (const char* column : {"median, %", "95th, %", "signed, %", "in two bars, %"}) {
      table.columns.push_back(fmt::format("{}: {}", figure, column));
    }
  }
  for (const Group& group : groups) {
    std::vector<lab::TrialOutcome> its;
    for (std::size_t k = 0; k < presses.trials.size(); ++k) {
      if (group.has(presses.trials[k], presses.outcomes[k])) its.push_back(presses.outcomes[k]);
    }
    const auto count = [&](auto&& is) { return std::to_string(std::count_if(its.begin(), its.end(), is)); };
    std::vector<std::string> row = {
        group.name, std::to_string(its.size()), count([](const auto& one) { return !one.failure.empty(); }),
        count([](const auto& one) { return one.reference_N > 0.0 && one.contact_vertices == 0; })};
    for (const auto figure : {&lab::TrialOutcome::force, &lab::TrialOutcome::depth, &lab::TrialOutcome::shear}) {
      const std::vector<std::string> cells = error_cells(lab::summarise(its, figure));
      row.insert(row.end(), cells.begin(), cells.end());
    }
    table.rows.push_back(row);
  }
  return table;
}

ResultTable totals_table(const Presses& presses, bool kept, double set_up_s, double press_s) {
  ResultTable table;
  table.name = "bodies-totals";
  table.title = fmt::format("{} bodies: what is wanted and what there is", presses.trials.size());
  table.columns = {"figure", "wanted", "force at a depth", "depth at a force", "force aside, dragged"};
  const lab::TrialSummary force = lab::summarise(presses.outcomes, &lab::TrialOutcome::force);
  const lab::TrialSummary depth = lab::summarise(presses.outcomes, &lab::TrialOutcome::depth);
  const lab::TrialSummary shear = lab::summarise(presses.outcomes, &lab::TrialOutcome::shear);
  const auto row = [&](const std::string& name, const std::string& wanted, auto&& cell) {
    table.rows.push_back({name, wanted, cell(force), cell(depth), cell(shear)});
  };
  row("bodies that have it", "all", [](const auto& sum) { return std::to_string(sum.count); });
  row("within two bars, %", fmt::format("at least {:.0f}", 100.0 * kWantedWithin),
      [](const auto& sum) { return fmt::format("{:.1f}", 100.0 * sum.within); });
  row("within two bars of its own, %", "-",
      [](const auto& sum) { return fmt::format("{:.1f}", 100.0 * sum.within_own); });
  row("median error, %", fmt::format("below {:.0f}", 100.0 * kWantedMedian),
      [](const auto& sum) { return percent(sum.median); });
  row("95th percentile, %", "-", [](const auto& sum) { return percent(sum.percentile95); });
  row("median with its sign, %", "-", [](const auto& sum) { return fmt::format("{:+.2f}", 100.0 * sum.middle); });
  const auto failed = std::count_if(presses.outcomes.begin(), presses.outcomes.end(),
                                    [](const auto& one) { return !one.failure.empty(); });
  table.rows.push_back({"bodies of which a press fails", "0", std::to_string(failed), "", ""});
  const auto blank = std::count_if(presses.outcomes.begin(), presses.outcomes.end(),
                                   [](const auto& one) { return one.reference_N <= 0.0; });
  table.remarks = {
      fmt::format("Set-up took {:.0f} s{} and all presses {:.0f} s, of all processors.", set_up_s,
                  kept ? ", gels that were kept being read," : "", press_s),
      fmt::format(
          "Errors are relative to the reference: the same gel with {} of the edges, pressed to the same depth. The "
          "depth at a force is compared where the reference has that depth. A dragged body's error is that of "
          "its force along the surface, as a vector; its sign is that of the size.",
          presses.gels.front().reference_edges),
      "A bar is the standard error that the program tells a user (fem::estimate_error; for depths divided by the "
      "stiffness of the press). Within two bars: at most twice the root of the sum of the squares of the gel's own bar "
      "and the reference's. Where nothing touches the gel's own mesh, its bar is zero.",
      fmt::format("{} bodies have no reference: it doesn't touch either, or its press fails.", blank),
      "Where a pattern's plate stays clear of the gel, the reference presses the pattern under a plate 2 mm farther "
      "away: the same problem, on which a plate that is near can't mislead it. Else the reference is made by the same "
      "contact, and a bias that finer edges don't lessen isn't seen."};
  return table;
}

ResultTable gels_table(const Presses& presses) {
  ResultTable table;
  table.name = "bodies-gels";
  table.title = "The gels";
  table.columns = {
      "gel", "mesh", "edge, mm", "tetrahedra", "surface vertices", "bar, smooth, 3 edges, %", "bar, sharp, 3 edges, %"};
  for (const lab::TrialGel& gel : presses.gels) {
    for (const bool own : {true, false}) {
      const fem::Compliance& mesh = own ? *gel.own : *gel.reference;
      const auto bar = [&](const fem::BodyErrors& errors) {
        return percent(fem::errors_at(errors, 3.0)[fem::ErrorOf::normal_force]);
      };
      table.rows.push_back({gel.name, own ? "own" : "reference",
                            fmt::format("{:.3g}", gel.device.mesh.fine_mm * (own ? 1.0 : gel.reference_edges)),
                            std::to_string(mesh.report.tetrahedra), std::to_string(mesh.vertices.size()),
                            bar(mesh.mesh_error.smooth), bar(mesh.mesh_error.sharp)});
    }
  }
  table.remarks = {"The bar is that of the force of contacts of three edges' radius."};
  return table;
}

ResultTable worst_table(const Presses& presses) {
  ResultTable table;
  table.name = "bodies-worst";
  table.title = "The ten whose force is most bars off";
  table.columns = {
      "body", "gel", "force, N", "off, %", "own bar, %", "reference's bar, %", "bars", "vertices in contact"};
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < presses.trials.size(); ++k) {
    if (presses.outcomes[k].force) order.push_back(k);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return presses.outcomes[a].force->bars() > presses.outcomes[b].force->bars();
  });
  order.resize(std::min(order.size(), kWorst));
  for (const std::size_t k : order) {
    const lab::TrialOutcome& outcome = presses.outcomes[k];
    table.rows.push_back({lab::in_words(presses.trials[k]), presses.gels[presses.trials[k].gel].name,
                          fmt::format("{:.4g}", outcome.reference_N),
                          fmt::format("{:+.2f}", 100.0 * outcome.force->off), percent(outcome.force->bar),
                          percent(outcome.force->reference_bar), fmt::format("{:.1f}", outcome.force->bars()),
                          std::to_string(outcome.contact_vertices)});
  }
  table.remarks = {"`--seed S --only N` presses one of them again."};
  return table;
}

ResultTable failure_table(const Presses& presses) {
  ResultTable table;
  table.name = "bodies-failures";
  table.title = "Presses that fail";
  table.columns = {"body", "gel", "message"};
  for (std::size_t k = 0; k < presses.trials.size(); ++k) {
    const lab::TrialOutcome& outcome = presses.outcomes[k];
    const std::string& gel = presses.gels[presses.trials[k].gel].name;
    if (!outcome.failure.empty()) table.rows.push_back({lab::in_words(presses.trials[k]), gel, outcome.failure});
    if (!outcome.reference_failure.empty()) {
      table.rows.push_back({lab::in_words(presses.trials[k]), gel, "reference: " + outcome.reference_failure});
    }
  }
  return table;
}

/// All trials one by one, in the CSV alone.
ResultTable all_table(const Presses& presses) {
  ResultTable table;
  table.name = "bodies-all";
  table.columns = {"body", "gel", "reference, N", "vertices", "area, mm^2", "strain", "seconds", "reference's seconds"};
  const std::array<std::pair<const char*, std::optional<lab::TrialError> lab::TrialOutcome::*>, 3> figures = {
      {{"force", &lab::TrialOutcome::force},
       {"depth", &lab::TrialOutcome::depth},
       {"shear", &lab::TrialOutcome::shear}}};
  for (const auto& [name, figure] : figures) {
    for (const char* column : {"off, %", "bar, %", "reference's bar, %"}) {
      table.columns.push_back(fmt::format("{}: {}", name, column));
    }
  }
  for (std::size_t k = 0; k < presses.trials.size(); ++k) {
    const lab::TrialOutcome& outcome = presses.outcomes[k];
    std::vector<std::string> row = {lab::in_words(presses.trials[k]),
                                    presses.gels[presses.trials[k].gel].name,
                                    fmt::format("{:.6g}", outcome.reference_N),
                                    std::to_string(outcome.contact_vertices),
                                    fmt::format("{:.4g}", outcome.contact_area),
                                    fmt::format("{:.3f}", outcome.largest_strain),
                                    fmt::format("{:.3f}", outcome.seconds),
                                    fmt::format("{:.3f}", outcome.reference_seconds)};
    for (const auto& [name, figure] : figures) {
      const std::optional<lab::TrialError>& error = outcome.*figure;
      for (const double value :
           {error ? error->off : NAN, error ? error->bar : NAN, error ? error->reference_bar : NAN}) {
        row.push_back(std::isnan(value) ? "" : fmt::format("{:.4f}", 100.0 * value));
      }
    }
    table.rows.push_back(row);
  }
  return table;
}

std::vector<Group> families() {
  std::vector<Group> groups;
  for (const std::string& family : lab::body_families()) {
    groups.push_back({family, [family](const auto& trial, const auto&) { return trial.body.family == family; }});
  }
  return groups;
}

std::vector<Group> others(const std::vector<lab::TrialGel>& gels) {
  std::vector<Group> groups;
  for (std::size_t k = 0; k < gels.size(); ++k) {
    groups.push_back({gels[k].name, [k](const auto& trial, const auto&) { return trial.gel == k; }});
  }
  for (const double friction : {0.0, 0.5}) {
    groups.push_back({fmt::format("mu {}", friction),
                      [friction](const auto& trial, const auto&) { return trial.friction == friction; }});
  }
  groups.push_back({"no plate", [](const auto& trial, const auto&) { return !trial.body.lifted; }});
  groups.push_back({"a plate that can't touch", [](const auto&, const auto& outcome) { return outcome.plate_lifted; }});
  groups.push_back({"a plate that may touch",
                    [](const auto& trial, const auto& outcome) { return trial.body.lifted && !outcome.plate_lifted; }});
  using lab::BodyPlace;
  for (const BodyPlace place :
       {BodyPlace::anywhere, BodyPlace::on_node, BodyPlace::on_edge, BodyPlace::on_axis, BodyPlace::along_edge}) {
    groups.push_back({lab::name_of(place), [place](const auto& trial, const auto&) { return trial.placed == place; }});
  }
  for (const auto& [low, high] : {std::pair{0, 0}, {1, 2}, {3, 12}, {13, 30}, {31, 1000}}) {
    groups.push_back({low == high ? "no vertex touches" : fmt::format("{} to {} vertices touch", low, high),
                      [low, high](const auto&, const auto& outcome) {
                        return outcome.contact_vertices >= low && outcome.contact_vertices <= high;
                      }});
  }
  groups.push_back({"reference's bar below 5 %", [](const auto&, const auto& outcome) {
                      return outcome.force && outcome.force->reference_bar < 0.05;
                    }});
  return groups;
}

}  // namespace
}  // namespace touchstone::bench

int main(int argc, char** argv) {
  using namespace touchstone;
  using namespace touchstone::bench;
  CLI::App app("Error and error bars of presses by bodies of many kinds");
  std::uint64_t seed = 1;
  int count = 0;
  int only = -1;
  std::filesystem::path cache;
  app.add_option("--seed", seed, "Of the draws (default 1)");
  app.add_option("--count", count, "Bodies (default 300, in the quick form 28)")->check(CLI::PositiveNumber);
  app.add_option("--only", only, "This body alone")->check(CLI::NonNegativeNumber);
  app.add_option("--cache", cache, "Where gels are kept between runs (default: nowhere)");
  return report_main("bodies", app, argc, argv, [&](Report& report) {
    Presses presses;
    const ProcessorStopwatch set_up;
    presses.gels = lab::set_up_trials(report.quick(), cache);
    const double set_up_s = set_up.seconds();
    if (count == 0) count = report.quick() ? 28 : 300;
    std::vector<int> numbers(static_cast<std::size_t>(only < 0 ? count : 1));
    std::iota(numbers.begin(), numbers.end(), std::max(0, only));
    for (const int number : numbers) presses.trials.push_back(lab::draw_trial(seed, number, presses.gels));
    presses.outcomes.resize(presses.trials.size());
    const ProcessorStopwatch pressing;
    tbb::parallel_for(std::size_t{0}, presses.trials.size(), [&](std::size_t k) {
      presses.outcomes[k] = lab::run_trial(presses.trials[k], presses.gels[presses.trials[k].gel]);
    });
    report.take(totals_table(presses, !cache.empty(), set_up_s, pressing.seconds()));
    report.take(group_table(presses, "families", "By family", families()));
    report.take(group_table(presses, "others", "By gel, friction, place and size", others(presses.gels)));
    report.take(worst_table(presses));
    report.take(failure_table(presses));
    report.take(gels_table(presses));
    report.keep(all_table(presses));
  });
}
