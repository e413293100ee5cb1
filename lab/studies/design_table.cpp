#include "lab/studies/design_table.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/dense_solvers.h"
#include "core/nearest_name.h"
#include "plots/heat_map.h"
#include "plots/line_plot.h"

namespace touchstone::lab {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Whether figure `f` of design a is better (1), as good (0) or worse (-1) than that of b.
int compared(const DesignTable& table, std::size_t f, std::size_t a, std::size_t b) {
  const double difference = table.values[a][f] - table.values[b][f];
  if (difference == 0.0 || table.figures[f].better == Better::near) return 0;
  return (difference < 0.0) == (table.figures[f].better == Better::lower) ? 1 : -1;
}

std::string cell(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::isinf(value) ? "inf" : "";
}

std::string to_csv(const DesignTable& table) {
  std::string csv;
  for (const DesignVariable& variable : table.plan.vary) csv += variable.path + ",";
  for (const DesignFigure& figure : table.figures) csv += figure.name + ",";
  csv += "fault\n";
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    for (const double value : table.points[d]) csv += fmt::format("{:.8g},", value);
    for (const double value : table.values[d]) csv += cell(value) + ",";
    std::string fault = table.faults[d];
    std::replace(fault.begin(), fault.end(), '"', '\'');
    csv += fault.empty() ? "\n" : fmt::format("\"{}\"\n", fault);
  }
  return csv;
}

std::string rows_of(const DesignTable& table, const std::vector<std::size_t>& designs) {
  std::string text = "|";
  for (const DesignVariable& variable : table.plan.vary) text += fmt::format(" {} |", variable.path);
  for (const DesignFigure& figure : table.figures) text += fmt::format(" {} |", figure.name);
  text += "\n|";
  for (std::size_t k = 0; k < table.plan.vary.size() + table.figures.size(); ++k) text += "---|";
  const auto row = [&](const std::string& head, const std::vector<double>& values) {
    text += "\n|" + head;
    for (const double value : values) {
      text += std::isnan(value) ? " - |" : fmt::format(" {:.3g} |", value);
    }
  };
  for (const std::size_t d : designs) {
    std::string head;
    for (const double value : table.points[d]) head += fmt::format(" {:.4g} |", value);
    row(head, table.values[d]);
  }
  if (!table.base.empty()) {
    std::string head = " as it is |";
    for (std::size_t v = 1; v < table.plan.vary.size(); ++v) head += " |";
    row(head, table.base);
  }
  return text + "\n";
}

std::string to_markdown(const DesignTable& table, const DesignStory& story) {
  std::string text = fmt::format("# {}\n\n{}\n\n{}\n", story.name, story.title, story.answer);
  std::vector<std::size_t> front = pareto_front(table, story.pareto);
  std::string of;
  for (const std::size_t f : story.pareto) of += fmt::format("{}{}", of.empty() ? "" : ", ", table.figures[f].name);
  text += fmt::format("\n## Designs than which none is better in {} and as good in the rest\n\n", of);
  if (!story.pareto.empty()) {
    std::sort(front.begin(), front.end(),
              [&](std::size_t a, std::size_t b) { return compared(table, story.pareto[0], a, b) > 0; });
  }
  text += front.empty() ? "None.\n" : rows_of(table, front);
  text +=
      "\n## By how many percent a figure changes with 1 % more of a variable\n\nA power law through all designs; R2 "
      "says how much of the figure's variation it explains.\n\n| figure |";
  for (const DesignVariable& variable : table.plan.vary) text += fmt::format(" {} |", variable.path);
  text += " R2 |\n|---|";
  for (std::size_t v = 0; v < table.plan.vary.size(); ++v) text += "---|";
  text += "---|\n";
  for (std::size_t f = 0; f < table.figures.size(); ++f) {
    const Elasticity found = elasticity(table, f);
    if (found.designs == 0) continue;
    text += fmt::format("| {} |", table.figures[f].name);
    for (const double slope : found.slope) text += fmt::format(" {:+.2f} |", slope);
    text += fmt::format(" {:.2f} |\n", found.r2);
  }
  text += "\n## Columns\n\n";
  for (const DesignFigure& figure : table.figures) text += fmt::format("- `{}`: {}\n", figure.name, figure.meaning);
  if (std::any_of(table.faults.begin(), table.faults.end(), [](const std::string& f) { return !f.empty(); })) {
    text += "\n## What couldn't be had\n\n";
    for (std::size_t d = 0; d < table.points.size(); ++d) {
      if (table.faults[d].empty()) continue;
      text += fmt::format("- {}: {}\n", name_of_point(table.plan, table.points[d]), table.faults[d]);
    }
  }
  return text;
}

bool is_map(const DesignPlan& plan) {
  return plan.sampling == DesignSampling::grid && plan.vary.size() == 2 && plan.vary[0].values.size() > 1 &&
         plan.vary[1].values.size() > 1;
}

std::string draw_map(const DesignTable& table, const DesignStory& story, std::size_t figure) {
  const DesignVariable& x = table.plan.vary[0];
  const DesignVariable& y = table.plan.vary[1];
  plots::HeatMap map{table.figures[figure].name, x.path, y.path, x.values, y.values, {}, {}, true};
  map.values.assign(x.values.size(), std::vector<double>(y.values.size()));
  map.marked.assign(x.values.size(), std::vector<bool>(y.values.size(), false));
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    map.values[d / y.values.size()][d % y.values.size()] = table.values[d][figure];
  }
  for (const std::size_t d : story.chosen) map.marked[d / y.values.size()][d % y.values.size()] = true;
  return plots::to_svg(map);
}

std::string draw_points(const DesignTable& table, std::size_t figure, std::size_t variable) {
  plots::LinePlot plot;
  plot.title = table.figures[figure].name;
  plot.x_label = table.plan.vary[variable].path;
  plot.y_label = table.figures[figure].name;
  plot.log_x = false;
  plot.curves.push_back({});
  plot.curves.back().joined = table.plan.vary.size() == 1 && table.plan.sampling == DesignSampling::grid;
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    plot.curves.back().points.emplace_back(table.points[d][variable], table.values[d][figure]);
  }
  return plots::to_svg(plot);
}

}  // namespace

DesignTable try_designs(const DesignPlan& plan, const DesignBase& base, std::vector<DesignFigure> figures,
                        const std::function<std::vector<double>(const sim::DeviceSpec&)>& judge, bool at_once,
                        const Progress& progress) {
  DesignTable table;
  table.plan = plan;
  table.figures = std::move(figures);
  table.points = design_points(plan);
  table.values.assign(table.points.size(), std::vector<double>(table.figures.size(), kNone));
  table.faults.resize(table.points.size());
  const auto count = static_cast<std::int64_t>(table.points.size());
  if (progress) progress("designs", 0, count);
  table.base = judge(base.device);
  std::atomic<std::int64_t> done = 0;
  const auto try_one = [&](std::size_t d) {
    try {
      table.values[d] = judge(design_at(base, plan, table.points[d]));
    } catch (const Error& error) {
      table.faults[d] = error.what();
    }
    if (progress) progress("designs", ++done, count);
  };
  if (!at_once) {
    for (std::size_t d = 0; d < table.points.size(); ++d) try_one(d);
    return table;
  }
  tbb::parallel_for(std::size_t{0}, table.points.size(), [&](std::size_t d) {
    // A thread that waits within a design must not begin another one, which would need its memory, too.
    tbb::this_task_arena::isolate([&] { try_one(d); });
  });
  return table;
}

std::size_t figure_number(std::span<const DesignFigure> figures, const std::string& name, const SourceLocation& where) {
  std::vector<std::string> known;
  for (std::size_t f = 0; f < figures.size(); ++f) {
    if (figures[f].name == name) return f;
    known.push_back(figures[f].name);
  }
  fail_at(where, "'{}' is no figure of this study{}; there are: {}", name, did_you_mean(name, known),
          fmt::join(known, ", "));
}

std::vector<std::size_t> pareto_front(const DesignTable& table, std::span<const std::size_t> figures) {
  const auto has_all = [&](std::size_t d) {
    return std::all_of(figures.begin(), figures.end(),
                       [&](std::size_t f) { return std::isfinite(table.values[d][f]); });
  };
  std::vector<std::size_t> front;
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    bool beaten = !has_all(d);
    for (std::size_t other = 0; other < table.points.size() && !beaten; ++other) {
      if (other == d || !has_all(other)) continue;
      bool better = false, worse = false;
      for (const std::size_t f : figures) {
        better = better || compared(table, f, other, d) > 0;
        worse = worse || compared(table, f, other, d) < 0;
      }
      beaten = better && !worse;
    }
    if (!beaten) front.push_back(d);
  }
  return front;
}

Elasticity elasticity(const DesignTable& table, std::size_t figure) {
  const auto variables = static_cast<Eigen::Index>(table.plan.vary.size());
  Elasticity found;
  found.slope = Eigen::VectorXd::Constant(variables, kNone);
  std::vector<std::size_t> rows;
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    const double value = table.values[d][figure];
    if (!std::isfinite(value)) continue;
    if (!(value > 0.0) ||
        std::any_of(table.points[d].begin(), table.points[d].end(), [](double x) { return x <= 0; })) {
      return found;
    }
    rows.push_back(d);
  }
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (count < variables + 2) return found;
  Eigen::MatrixXd x(count, variables + 1);
  Eigen::VectorXd y(count);
  for (Eigen::Index r = 0; r < count; ++r) {
    const std::size_t d = rows[static_cast<std::size_t>(r)];
    x(r, 0) = 1.0;
    for (Eigen::Index v = 0; v < variables; ++v) x(r, v + 1) = std::log(table.points[d][static_cast<std::size_t>(v)]);
    y[r] = std::log(table.values[d][figure]);
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(x);
  if (qr.rank() < x.cols()) return found;
  const Eigen::VectorXd law = qr.solve(y);
  const double all = (y.array() - y.mean()).square().sum();
  found.slope = law.tail(variables);
  found.r2 = all > 0.0 ? 1.0 - (y - x * law).squaredNorm() / all : 1.0;
  found.designs = static_cast<int>(count);
  return found;
}

StudyResult design_report(const DesignTable& table, const DesignStory& story) {
  StudyResult result;
  result.files.push_back({story.name + ".csv", to_csv(table)});
  result.files.push_back({story.name + ".md", to_markdown(table, story)});
  for (const std::size_t f : story.drawn) {
    const std::string name = story.name + "-" + table.figures[f].name;
    if (is_map(table.plan)) {
      result.files.push_back({name + ".svg", draw_map(table, story, f)});
      continue;
    }
    for (std::size_t v = 0; v < table.plan.vary.size(); ++v) {
      std::string path = table.plan.vary[v].path;
      std::erase_if(path, [](char c) { return c == '*' || c == '[' || c == ']'; });
      std::replace(path.begin(), path.end(), '.', '-');
      result.files.push_back({fmt::format("{}-over-{}.svg", name, path), draw_points(table, f, v)});
    }
  }
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    if (table.faults[d].empty()) continue;
    result.notes.push_back(fmt::format("{}: {}", name_of_point(table.plan, table.points[d]), table.faults[d]));
  }
  return result;
}

}  // namespace touchstone::lab
