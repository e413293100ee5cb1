#pragma once
// The little of CSV that recorded frames' tables need: cells without quotes, numbers without blanks.

#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/named_file.h"
#include "core/whole_file.h"

namespace touchstone::datasets {

/// The cells of a line, empty ones too.
inline std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::size_t begin = 0;
  for (std::size_t comma = line.find(','); comma != std::string::npos; comma = line.find(',', begin)) {
    cells.push_back(line.substr(begin, comma - begin));
    begin = comma + 1;
  }
  cells.push_back(line.substr(begin));
  return cells;
}

/// The number that a cell holds, if it holds nothing else.
template <typename T>
std::optional<T> number_of(const std::string& text) {
  T value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

/// @throws Error naming the cell's field at `where` unless the cell holds a whole number of that type
template <typename T>
T whole_number_in(const std::string& cell, const char* field, const SourceLocation& where) {
  const auto value = number_of<T>(cell);
  if (!value) fail_at(where, "{}: '{}' isn't a whole number", field, cell);
  return *value;
}

/// @throws Error naming the cell's field at `where` unless the cell holds a finite number
inline double number_in(const std::string& cell, const char* field, const SourceLocation& where) {
  const auto value = number_of<double>(cell);
  if (!value || !std::isfinite(*value)) fail_at(where, "{}: '{}' isn't a finite number", field, cell);
  return *value;
}

/// The file of `folder` that a cell of the field `file` names. @throws Error at `where` if there is none
inline std::filesystem::path file_in(const std::filesystem::path& folder, const std::string& cell,
                                     const SourceLocation& where) {
  std::filesystem::path file = folder / cell;
  if (const std::string fault = fault_of_file(file); !fault.empty()) fail_at(where, "file: {}", fault);
  return file;
}

/// Calls `row(where, cells)` for each line of a table after its first one, which must be `columns`; empty lines are
/// passed over. @throws Error naming file and line if the first line or a line's number of cells is another
template <typename Row>
void for_each_row(const std::filesystem::path& csv, const std::string& columns, const Row& row) {
  std::istringstream lines(read_whole_file(csv));
  const std::size_t count = cells_of(columns).size();
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const SourceLocation where{csv.string(), number};
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 1) {
      if (line != columns) fail_at(where, "the first line is '{}'; it must be '{}'", line, columns);
      continue;
    }
    if (line.empty()) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != count) fail_at(where, "has {} cells; {} are needed: {}", cells.size(), count, columns);
    row(where, cells);
  }
}

}  // namespace touchstone::datasets
