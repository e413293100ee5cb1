#pragma once
// Measured figures as CSV and as Markdown.

#include <filesystem>
#include <string>
#include <vector>

#include "plots/line_plot.h"

namespace touchstone::bench {

/// Rows of cells under columns; a cell is text as it shall stand.
struct ResultTable {
  std::string name;   ///< of the file: "mechanics-mesh"
  std::string title;  ///< a sentence over it
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> remarks;    ///< sentences under it
  std::vector<plots::LinePlot> plots;  ///< beside it: <name>-1.svg, ...
};

/// Writes <folder>/<name>.csv, which begins with '#' lines that say where it was measured, and the plots.
void write_files(const ResultTable& table, const std::vector<std::string>& where, const std::filesystem::path& folder);

/// A section: title, table, plots by name, remarks.
std::string to_markdown(const ResultTable& table);

}  // namespace touchstone::bench
