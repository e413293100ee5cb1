#pragma once
// Reading a model file's JSON strictly. For the .cpp files of models only: it brings in all of nlohmann-json.

#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/json_depth.h"
#include "core/nearest_name.h"

namespace touchstone::sensors {

/// Objects sort their keys, so the same model gives the same bytes.
using Json = nlohmann::json;

/// @throws Error naming the file if the text is nested deeper than kDeepestJson: for any such text, JSON or not
inline void refuse_deep_json(std::string_view text, const SourceLocation& where) {
  if (const int depth = deepest_json(text); depth > kDeepestJson) {
    fail_at(where, "has lists and maps {} deep in each other; at most {} are read", depth, kDeepestJson);
  }
}

/// @throws Error naming the file and, where it's known, the line
inline Json parse_json(const std::string& text, const std::string& name) {
  refuse_deep_json(text, {name, 0});
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    const auto byte = std::min(error.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(byte), '\n');
    throw Error({name, static_cast<int>(line)}, "isn't valid JSON");
  } catch (const Json::exception& error) {  // a number beyond the range of double
    throw Error({name, 0}, fmt::format("isn't usable JSON: {}", error.what()));
  }
}

/// A value of a model file and the path of names that leads to it. What doesn't fit is an Error with file and path.
struct JsonField {
  const Json& value;
  std::string path;
  const std::string& file;

  /// Throws an Error with file and path; the message is formatted by {fmt}.
  template <typename... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    const std::string message = fmt::format(format, std::forward<Args>(args)...);
    fail_at({file, 0}, "{}{}{}", path, path.empty() ? "" : ": ", message);
  }

  /// The value behind a name of a map. It must be there.
  JsonField at(const char* key) const {
    const auto found = value.find(key);
    if (found == value.end()) refuse("'{}' is missing", key);
    return {*found, path.empty() ? key : path + "." + key, file};
  }
  JsonField at(std::size_t index) const { return {value[index], fmt::format("{}[{}]", path, index), file}; }

  /// Refuses what isn't a map with this format's name and version.
  void expect_format(const char* format, int version) const {
    if (!value.is_object()) refuse("is a {}, a map is needed", value.type_name());
    if (at("format").text() != format) at("format").refuse("is '{}', '{}' is needed", at("format").text(), format);
    at("version").whole_number(version, version);
  }

  /// Refuses what isn't a map of exactly these names.
  void expect_map(const std::vector<std::string>& names) const {
    if (!value.is_object()) refuse("is a {}, a map is needed", value.type_name());
    for (const auto& [key, unused] : value.items()) {
      if (std::find(names.begin(), names.end(), key) == names.end()) {
        refuse("'{}' isn't known{}", key, did_you_mean(key, names));
      }
    }
    for (const std::string& name : names) at(name.c_str());
  }

  /// Refuses what isn't a list of this length.
  void expect_list(std::size_t size) const {
    if (!value.is_array()) refuse("is a {}, a list of {} is needed", value.type_name(), size);
    if (value.size() != size) refuse("has {} entries, {} are needed", value.size(), size);
  }

  /// A finite number.
  double number() const {
    if (!value.is_number()) refuse("is a {}, a number is needed", value.type_name());
    const double number = value.get<double>();
    if (!std::isfinite(number)) refuse("is {}, a finite number is needed", number);
    return number;
  }

  /// From `low` to `high`.
  std::int64_t whole_number(std::int64_t low, std::int64_t high) const {
    if (!value.is_number_integer()) refuse("is {}, a whole number is needed", value.dump());
    // Unsigned values beyond the signed range would turn negative: compare them as they are.
    const bool too_large = value.is_number_unsigned() && value.get<std::uint64_t>() > static_cast<std::uint64_t>(high);
    if (too_large || value.get<std::int64_t>() < low || value.get<std::int64_t>() > high) {
      refuse("is {}, it must be from {} to {}", value.dump(), low, high);
    }
    return value.get<std::int64_t>();
  }

  /// true or false.
  bool truth() const {
    if (!value.is_boolean()) refuse("must be true or false");
    return value.get<bool>();
  }

  /// A string.
  std::string text() const {
    if (!value.is_string()) refuse("is a {}, text is needed", value.type_name());
    return value.get<std::string>();
  }

  /// A list of N finite numbers.
  template <int N>
  Eigen::Matrix<double, N, 1> vector() const {
    expect_list(N);
    Eigen::Matrix<double, N, 1> result;
    for (std::size_t i = 0; i < N; ++i) result[static_cast<Eigen::Index>(i)] = at(i).number();
    return result;
  }

  /// A list of this many such lists.
  template <int N>
  std::vector<Eigen::Matrix<double, N, 1>> vectors(std::size_t size) const {
    expect_list(size);
    std::vector<Eigen::Matrix<double, N, 1>> result;
    for (std::size_t i = 0; i < size; ++i) result.push_back(at(i).vector<N>());
    return result;
  }

  /// The one of `values` whose name_of() stands here.
  template <typename E, std::size_t N>
  E name_among(const std::array<E, N>& values) const {
    const std::string name = text();
    std::vector<std::string> known;
    for (const E one : values) {
      if (name == name_of(one)) return one;
      known.emplace_back(name_of(one));
    }
    refuse("is '{}', it must be one of {}{}", name, fmt::format("{}", fmt::join(known, ", ")),
           did_you_mean(name, known));
  }
};

}  // namespace touchstone::sensors
