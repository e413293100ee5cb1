#include "lab/validation/validation_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "plots/line_plot.h"

namespace touchstone::lab {
namespace {

constexpr const char* kStyle = R"(
body { font-family: sans-serif; margin: 2em auto; max-width: 75em; padding: 0 1em; color: #222; background: #fff; }
table { border-collapse: collapse; width: 100%; font-size: 0.9em; }
th, td { text-align: left; padding: 0.3em 0.6em; border-bottom: 1px solid #ddd; vertical-align: top; }
th { border-bottom: 2px solid #888; }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.id { font-family: monospace; }
td.yes { color: #006b4f; }
td.no { color: #fff; background: #b3261e; font-weight: bold; }
svg { max-width: 100%; height: auto; }
figure { margin: 1em 0; }
)";

constexpr const char* kColumns[] = {"row",   "what",         "ours",   "95 % interval", "held against",
                                    "error", "good when it", "holds?", "seconds"};

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : std::string("-");
}

std::string with_unit(const std::string& value, const std::string& unit) {
  return unit == "1" || unit.empty() ? value : value + " " + unit;
}

std::string interval(const ValidationRow& row) {
  return row.ci95 ? fmt::format("{} to {}", number(row.ci95->first), number(row.ci95->second)) : std::string("-");
}

std::string held_against(const ValidationRow& row) {
  if (row.published) return with_unit(number(*row.published), row.unit) + " (published)";
  if (row.reference) return with_unit(number(*row.reference), row.unit) + " (theory)";
  return "-";
}

/// In percent of the figure held against; the difference where that is zero.
std::string error_text(const ValidationRow& row) {
  const std::optional<double>& against = row.published ? row.published : row.reference;
  if (!against || !std::isfinite(row.ours) || !std::isfinite(*against)) return "-";
  if (*against == 0.0) return with_unit(fmt::format("{:+.3g}", row.ours), row.unit);
  return fmt::format("{:+.3g} %", 100.0 * (row.ours / *against - 1.0));
}

std::string good_when(Better better) {
  switch (better) {
    case Better::lower:
      return "is lower";
    case Better::higher:
      return "is higher";
    case Better::near:
      break;
  }
  return "is near";
}

std::string group_of(const ValidationRow& row) {
  return row.id.substr(0, row.id.find('.'));
}

/// The groups in the order in which they first occur, each with its rows.
std::vector<std::pair<std::string, std::vector<const ValidationRow*>>> by_group(
    const std::vector<ValidationRow>& rows) {
  std::vector<std::pair<std::string, std::vector<const ValidationRow*>>> groups;
  for (const ValidationRow& row : rows) {
    const std::string name = group_of(row);
    auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& one) { return one.first == name; });
    if (group == groups.end()) group = groups.insert(groups.end(), {name, {}});
    group->second.push_back(&row);
  }
  return groups;
}

std::vector<std::string> cells(const ValidationRow& row) {
  return {row.id,
          words_of(row) + (row.quick ? " (quick form)" : ""),
          with_unit(number(row.ours), row.unit),
          interval(row),
          held_against(row),
          error_text(row),
          good_when(row.better),
          row.holds ? "yes" : "NO",
          fmt::format("{:.1f}", row.seconds)};
}

std::string summary(const std::vector<ValidationRow>& rows) {
  const auto held = std::count_if(rows.begin(), rows.end(), [](const ValidationRow& row) { return row.holds; });
  return fmt::format("{} of {} rows hold.", held, rows.size());
}

std::vector<std::string> header_lines(const PageHeader& header) {
  std::vector<std::string> lines = {"Touchstone " + header.version, "Processor: " + header.processor};
  if (!header.date.empty()) lines.push_back("Date: " + header.date);
  return lines;
}

std::string plot_of(const ValidationRow& row) {
  plots::LinePlot plot;
  plot.title = row.id;
  plot.x_label = row.series->x_label;
  plot.y_label = row.series->y_label;
  plot.log_x = plot.log_y = row.series->logarithmic;
  plot.curves.push_back({"", row.series->points, false, row.series->joined});
  return fmt::format("<figure>\n{}<figcaption>{}</figcaption>\n</figure>\n", plots::to_svg(plot),
                     plots::escape_markup(row.title));
}

/// One cell of a Markdown table: no line ends, pipes and markup escaped.
std::string markdown_cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      escaped += ' ';
      continue;
    }
    if (c == '|' || c == '\\' || c == '*' || c == '_' || c == '`' || c == '<' || c == '[') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

}  // namespace

std::string to_html(const std::vector<ValidationRow>& rows, const PageHeader& header) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>Touchstone: validation</title>\n<style>{}</style>\n</head>\n<body>\n<h1>Validation</h1>\n",
      kStyle);
  for (const std::string& line : header_lines(header)) page += fmt::format("<p>{}</p>\n", plots::escape_markup(line));
  page += fmt::format("<p>{}</p>\n", summary(rows));
  for (const auto& [name, group] : by_group(rows)) {
    page += fmt::format("<h2>{}</h2>\n<table>\n<tr>", plots::escape_markup(name));
    for (const char* column : kColumns) page += fmt::format("<th>{}</th>", column);
    page += "</tr>\n";
    for (const ValidationRow* row : group) {
      const std::vector<std::string> texts = cells(*row);
      page += "<tr>";
      for (std::size_t c = 0; c < texts.size(); ++c) {
        const char* kind = c == 0 ? "id" : c == 1 || c == 6 ? "text" : c == 7 ? (row->holds ? "yes" : "no") : "number";
        page += fmt::format("<td class=\"{}\">{}</td>", kind, plots::escape_markup(texts[c]));
      }
      page += "</tr>\n";
    }
    page += "</table>\n";
    for (const ValidationRow* row : group) {
      if (row->series) page += plot_of(*row);
    }
  }
  return page + "</body>\n</html>\n";
}

std::string to_markdown(const std::vector<ValidationRow>& rows, const PageHeader& header) {
  std::string page = "# Validation\n\n";
  for (const std::string& line : header_lines(header)) page += fmt::format("- {}\n", markdown_cell(line));
  page += fmt::format("- {}\n", summary(rows));
  for (const auto& [name, group] : by_group(rows)) {
    page += fmt::format("\n## {}\n\n|", markdown_cell(name));
    for (const char* column : kColumns) page += fmt::format(" {} |", column);
    page += "\n|";
    for (std::size_t c = 0; c < std::size(kColumns); ++c) page += " --- |";
    page += "\n";
    for (const ValidationRow* row : group) {
      page += "|";
      for (const std::string& text : cells(*row)) page += fmt::format(" {} |", markdown_cell(text));
      page += "\n";
    }
    for (const ValidationRow* row : group) {
      if (!row->series) continue;
      page += fmt::format("\n{}: {} against {}:", markdown_cell(row->id), markdown_cell(row->series->y_label),
                          markdown_cell(row->series->x_label));
      for (const auto& [x, y] : row->series->points) page += fmt::format(" ({}, {})", number(x), number(y));
      page += "\n";
    }
  }
  return page;
}

}  // namespace touchstone::lab
