#include "bench/result_table.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/whole_file.h"

namespace touchstone::bench {
namespace {

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string doubled;
  for (const char c : text) doubled.append(c == '"' ? 2 : 1, c);
  return fmt::format("\"{}\"", doubled);
}

std::string plot_name(const ResultTable& table, std::size_t k) {
  return fmt::format("{}-{}.svg", table.name, k + 1);
}

}  // namespace

void write_files(const ResultTable& table, const std::vector<std::string>& where, const std::filesystem::path& folder) {
  std::string csv;
  for (const std::string& line : where) csv += fmt::format("# {}\n", line);
  std::vector<std::vector<std::string>> lines = {table.columns};
  lines.insert(lines.end(), table.rows.begin(), table.rows.end());
  for (const std::vector<std::string>& line : lines) {
    TS_ASSERT(line.size() == table.columns.size());
    for (std::size_t c = 0; c < line.size(); ++c) csv += fmt::format("{}{}", c == 0 ? "" : ",", csv_cell(line[c]));
    csv += "\n";
  }
  write_whole_file(folder / (table.name + ".csv"), csv);
  for (std::size_t k = 0; k < table.plots.size(); ++k) {
    write_whole_file(folder / plot_name(table, k), plots::to_svg(table.plots[k]));
  }
}

std::string to_markdown(const ResultTable& table) {
  std::string text = fmt::format("\n## {}\n\n|", table.title);
  for (const std::string& column : table.columns) text += fmt::format(" {} |", column);
  text += "\n|";
  for (std::size_t c = 0; c < table.columns.size(); ++c) text += " ---: |";
  text += "\n";
  for (const std::vector<std::string>& row : table.rows) {
    text += "|";
    for (const std::string& cell : row) text += fmt::format(" {} |", cell);
    text += "\n";
  }
  for (std::size_t k = 0; k < table.plots.size(); ++k) {
    text += fmt::format("\n![{}]({})\n", table.plots[k].title, plot_name(table, k));
  }
  if (!table.remarks.empty()) text += "\n";
  for (const std::string& remark : table.remarks) text += fmt::format("- {}\n", remark);
  return text;
}

}  // namespace touchstone::bench
