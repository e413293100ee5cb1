#pragma once
// The little of CSV that recorded frames' tables need: cells without quotes, numbers without blanks.

#include <charconv>
#include <optional>
#include <string>
#include <vector>

namespace touchstone::lab {

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

}  // namespace touchstone::lab
