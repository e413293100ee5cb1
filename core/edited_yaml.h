#pragma once
// Numbers and files' names of a YAML document changed in its text: all else stays as it was written, and every line
// keeps its number.

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"

namespace touchstone {

/// A number where it stands in a text.
struct YamlNumber {
  std::string path;  ///< "lamps[2].power_W[0]"
  double value = 0.0;
  std::size_t begin = 0, size = 0;  ///< bytes
};

/// The numbers that a path names: keys joined by dots; `[2]` is the third item of a list, `[*]` each of its items. One
/// group for each place that the path leads to: a number, or a list, whose numbers then belong together. So
/// `lamps[*].power_W` gives a group a lamp, and `lamps[*].power_W[*]` one a number.
/// `name` stands for the text in messages, `where` is where the path was asked for.
/// @throws Error if a key isn't there (it names the nearest), a list is shorter, what is there isn't made of plain
///   numbers, stands behind a YAML alias, so that a change would show elsewhere, or more than 64 keys and lists deep
std::vector<std::vector<YamlNumber>> find_yaml_numbers(const std::string& text, const std::string& name,
                                                       const std::string& path, const SourceLocation& where);

/// The text with other numbers (the shortest decimal ones that are read back as they are). @pre `numbers` were found in
/// this very text, none twice
std::string with_yaml_numbers(const std::string& text, const std::vector<std::pair<YamlNumber, double>>& numbers);

/// The text for a file in the folder `to` that was one in `from`: each value that is the relative name of a file in
/// `from`, with a dot in it, is named from `to` on. Other values stay, also the names of files that aren't there, and
/// all of a text that aliases make larger than 100,000 values.
/// @pre the text is YAML
std::string with_yaml_files_from(const std::string& text, const std::filesystem::path& from,
                                 const std::filesystem::path& to);

}  // namespace touchstone
