// The files of a study of apparent change: table.csv, table.md and one plot an object, force and measure.

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "lab/studies/study.h"
#include "plots/line_plot.h"

namespace touchstone::lab {
namespace {

// Of the four measures these two are drawn: the constraint as it's printed, and the one with an optimum in between.
constexpr int kDrawn[] = {0, 2};
static_assert(kStudiedMeasures[0] == ApparentMeasure::relative_whole_fixed);
static_assert(kStudiedMeasures[2] == ApparentMeasure::picture_film_fixed);

std::string name_of(ApparentMeasure measure) {
  for (const auto& [name, known] : enum_names(ApparentMeasure{})) {
    if (known == measure) return name;
  }
  TS_ASSERT(false);
  return {};
}

/// A number of a table; what couldn't be had is an empty cell.
std::string cell(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "";
}

std::string to_csv(const ApparentChangeSpec& spec, const ApparentChangeResult& result) {
  std::string csv =
      fmt::format("object,by,force_N,{},lens_mm,displacement_mm,stretch,largest_strain", lab::name_of(spec.vary.field));
  for (const ApparentMeasure measure : kStudiedMeasures) csv += fmt::format(",{}", name_of(measure));
  csv += "\n";
  for (const ApparentChangeRow& row : result.rows) {
    csv += fmt::format("{},{},{:.6g},{:.6g},{:.6g},{},{},{}", row.object, lab::name_of(row.source), row.force_N,
                       row.value, row.lens_mm, cell(row.displacement_mm), cell(row.stretch), cell(row.largest_strain));
    for (const double measure : row.measure) csv += fmt::format(",{}", cell(measure));
    csv += "\n";
  }
  return csv;
}

std::string to_markdown(const std::string& name, const ApparentChangeSpec& spec, const ApparentChangeResult& result) {
  const std::string field = lab::name_of(spec.vary.field);
  std::string text = fmt::format(
      "# {}\n\nWhere a marker of {:.4g} mm on the gel of {} changes most in a picture under a force on it: `{}` from "
      "{:.4g} to {:.4g}.\nIn brackets the change there; `end`: it is largest at an end of what could be had, so there "
      "is no optimum in between.\n\n| object | by | force N | lens mm |",
      name, spec.marker_mm, spec.device.name, field, spec.vary.values.front(), spec.vary.values.back());
  for (const ApparentMeasure measure : kStudiedMeasures) text += fmt::format(" {} |", name_of(measure));
  text += "\n|---|---|---|---|";
  for (int k = 0; k < kStudiedMeasureCount; ++k) text += "---|";
  text += "\n";
  const std::vector<ApparentOptimum> optima = optima_of(result);
  const ApparentChangeRow* of = nullptr;
  int column = 0;
  const auto fill_up = [&](int to) {
    for (; column < to; ++column) text += " - |";
  };
  for (const ApparentOptimum& optimum : optima) {
    const bool same = of != nullptr && of->object == optimum.of.object && of->source == optimum.of.source &&
                      of->force_N == optimum.of.force_N && of->lens_mm == optimum.of.lens_mm;
    if (!same) {
      if (of != nullptr) {
        fill_up(kStudiedMeasureCount);
        text += "\n";
      }
      text += fmt::format("| {} | {} | {:.4g} | {:.4g} |", optimum.of.object, lab::name_of(optimum.of.source),
                          optimum.of.force_N, optimum.of.lens_mm);
      column = 0;
    }
    of = &optimum.of;
    fill_up(static_cast<int>(std::find(std::begin(kStudiedMeasures), std::end(kStudiedMeasures), optimum.measure) -
                             std::begin(kStudiedMeasures)));
    text += fmt::format(" {:.3g}{} ({:.3g}) |", optimum.value, optimum.interior ? "" : " end", optimum.change);
    ++column;
  }
  if (of != nullptr) {
    fill_up(kStudiedMeasureCount);
    text += "\n";
  }
  if (!result.notes.empty()) text += "\nWhat couldn't be had:\n\n";
  for (const std::string& note : result.notes) text += fmt::format("- {}\n", note);
  return text;
}

plots::LinePlot plot_of(const ApparentChangeSpec& spec, const ApparentChangeResult& result, const std::string& object,
                        double force, int measure) {
  plots::LinePlot plot;
  plot.title = fmt::format("{}, {:.4g} N: {}", object, force, name_of(kStudiedMeasures[measure]));
  plot.x_label = lab::name_of(spec.vary.field);
  plot.y_label = "apparent change";
  plot.log_x = false;
  // Beside the formula the better one of the simulations: with both, lenses couldn't be distinguished.
  const ApparentSource best = *std::max_element(spec.by.begin(), spec.by.end());
  for (const ApparentChangeRow& row : result.rows) {
    const bool formula = row.source == ApparentSource::formula;
    if (row.force_N != force || !(formula || (row.object == object && row.source == best))) continue;
    const std::string name = fmt::format("{:.4g} mm, {}", row.lens_mm, lab::name_of(row.source));
    if (plot.curves.empty() || plot.curves.back().name != name) plot.curves.push_back({name, {}, formula});
    plot.curves.back().points.emplace_back(row.value, row.measure[measure]);
  }
  return plot;
}

}  // namespace

StudyResult report(const std::string& name, const ApparentChangeSpec& spec, const ApparentChangeResult& result) {
  StudyResult files;
  files.files.push_back({name + ".csv", to_csv(spec, result)});
  files.files.push_back({name + ".md", to_markdown(name, spec, result)});
  for (std::size_t k = 0; k < spec.objects.size(); ++k) {
    for (const double force : spec.force_N) {
      for (const int measure : kDrawn) {
        files.files.push_back(
            {fmt::format("{}-{}-{}N-{}.svg", name, spec.objects[k].name, force, name_of(kStudiedMeasures[measure])),
             plots::to_svg(plot_of(spec, result, spec.objects[k].name, force, measure))});
      }
    }
  }
  files.notes = result.notes;
  return files;
}

}  // namespace touchstone::lab
