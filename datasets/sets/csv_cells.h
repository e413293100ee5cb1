#pragma once
// The little of CSV that recorded frames' tables need: numbers without blanks, no line's end within quotes.

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/named_file.h"
#include "core/text_file.h"

namespace touchstone::datasets {

/// The cells of a line, empty ones too. One that begins with a quote goes to the next lone quote; two of them in it
/// stand for one. @throws Error at `where` for a quote without an end, or with anything but a comma behind it
inline std::vector<std::string> cells_of(std::string_view line, const SourceLocation& where) {
  std::vector<std::string> cells;
  for (;;) {
    std::string cell;
    if (line.starts_with('"')) {
      line.remove_prefix(1);
      for (;; line.remove_prefix(1)) {
        if (line.empty()) fail_at(where, "a quote has no end");
        if (line.starts_with("\"\"")) {
          line.remove_prefix(1);
        } else if (line.front() == '"') {
          break;
        }
        cell += line.front();
      }
      line.remove_prefix(1);
      if (!line.empty() && line.front() != ',') fail_at(where, "'{}' stands behind a quote's end", line);
    } else {
      cell = line.substr(0, line.find(','));
      line.remove_prefix(cell.size());
    }
    cells.push_back(std::move(cell));
    if (line.empty()) return cells;
    line.remove_prefix(1);  // the comma
  }
}

/// A text as a cell: in quotes where a comma, a quote or the end of a line would break it.
inline std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + "\"";
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

/// A table's first line, which must be one of those that are allowed. @throws Error naming the file
inline std::string header_among(const std::filesystem::path& csv, const std::vector<std::string>& allowed) {
  const std::string text = read_text_file(csv);
  std::string head = text.substr(0, text.find('\n'));
  if (!head.empty() && head.back() == '\r') head.pop_back();
  if (std::find(allowed.begin(), allowed.end(), head) == allowed.end()) {
    fail_at({csv.string(), 1}, "the first line is '{}'; it must be one of '{}'", head, fmt::join(allowed, "', '"));
  }
  return head;
}

/// Calls `row(where, cells)` for each line of a table after its first one, which must be `columns`; empty lines are
/// passed over. @throws Error naming file and line if the first line or a line's number of cells is another
template <typename Row>
void for_each_row(const std::filesystem::path& csv, const std::string& columns, const Row& row) {
  std::istringstream lines(read_text_file(csv));
  const std::vector<std::string> wanted = cells_of(columns, {csv.string(), 0});
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const SourceLocation where{csv.string(), number};
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 1) {
      if (cells_of(line, where) != wanted) fail_at(where, "the first line is '{}'; it must be '{}'", line, columns);
      continue;
    }
    if (line.empty()) continue;
    const std::vector<std::string> cells = cells_of(line, where);
    if (cells.size() != wanted.size()) {
      fail_at(where, "has {} cells; {} are needed: {}", cells.size(), wanted.size(), columns);
    }
    row(where, cells);
  }
}

}  // namespace touchstone::datasets
