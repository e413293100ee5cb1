#pragma once
// Strict reading of YAML into plain structs. A struct that can be read has, beside it, a function
//
//   void fields(YamlReader& in, GelSpec& gel) {
//     in.required("thickness_mm", gel.thickness_mm, Allowed::above(0.0));
//     in.optional("poisson_ratio", gel.poisson_ratio, Allowed::within(0.0, 0.5));
//   }
//
// found by its argument's namespace. Nested structs, std::vector, std::optional, Eigen vectors, and enums (by a
// function `enum_names(E)`) work in the same way. A key that no field asks for is an error that names the nearest one;
// so is a key that stands twice, a value of the wrong kind, outside the allowed range, NaN or infinite.

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"

namespace touchstone {

/// The range that a number may have.
struct Allowed {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_itself = true;
  bool high_itself = true;

  static Allowed any() { return {}; }
  static Allowed above(double low) { return {.low = low, .low_itself = false}; }
  static Allowed at_least(double low) { return {.low = low}; }
  static Allowed within(double low, double high) { return {.low = low, .high = high}; }
  /// low < value <= high
  static Allowed above_up_to(double low, double high) { return {.low = low, .high = high, .low_itself = false}; }

  bool holds(double value) const;
  std::string text() const;  ///< "above 0", "from 0 to 0.5"
};

/// A table of an enum's names, as `enum_names` returns it.
template <typename E>
using EnumNames = std::vector<std::pair<std::string, E>>;

class YamlReader {
 public:
  /// Parses a file whose root is a map. @throws Error with file and line
  static YamlReader open(const std::filesystem::path& file);
  /// Parses a text; `name` stands for the file in messages.
  static YamlReader parse(const std::string& text, const std::string& name);

  /// Reads the field `key`, which must be there.
  template <typename T>
  void required(const std::string& key, T& value, Allowed allowed = {}) {
    auto node = child(key);
    if (!node) refuse_missing(key);
    node->read(value, allowed);
  }

  /// Reads the field `key` if it's there, else leaves `value` as it is.
  template <typename T>
  void optional(const std::string& key, T& value, Allowed allowed = {}) {
    if (auto node = child(key)) node->read(value, allowed);
  }

  bool has(const std::string& key) const;
  /// Where the field `key` stands, or the map itself if it isn't there.
  SourceLocation where(const std::string& key) const;
  SourceLocation where() const;
  /// The folder of the file, against which relative paths in it are meant.
  std::filesystem::path folder() const;

  // For types that may stand in several forms: they have, in the place of `fields`, a function
  // `read_value(YamlReader& in, T& value, Allowed allowed)` that looks what stands there.
  bool is_list() const;
  bool is_map() const;
  std::string text() const { return scalar("a number, a list or a file's name"); }
  double number(Allowed allowed) const;
  std::vector<double> numbers(Allowed allowed) const;  ///< of a list
  std::string context() const;                         ///< the field, for messages: "gel.thickness_mm: " or ""

  /// Reads this whole map into a struct by its `fields`, and refuses keys that it didn't ask for.
  template <typename T>
  void read_struct(T& value) {
    require_map();
    fields(*this, value);
    finish();
  }

 private:
  struct Node;
  explicit YamlReader(std::shared_ptr<Node> node) : node_(std::move(node)) {}

  std::optional<YamlReader> child(const std::string& key);
  std::vector<YamlReader> items() const;  ///< of a sequence
  std::string scalar(const char* kind) const;
  void require_map() const;
  void finish() const;
  [[noreturn]] void refuse_missing(const std::string& key) const;

  void read(double& value, Allowed allowed) { value = number(allowed); }
  void read(int& value, Allowed allowed) { value = small_integer(allowed); }
  void read(std::int64_t& value, Allowed allowed) { value = integer(allowed); }
  void read(std::uint64_t& value, Allowed allowed) { value = unsigned_integer(allowed); }
  void read(bool& value, Allowed);
  void read(std::string& value, Allowed) { value = scalar("text"); }
  std::int64_t integer(Allowed allowed) const;
  int small_integer(Allowed allowed) const;
  std::uint64_t unsigned_integer(Allowed allowed) const;

  template <typename Scalar, int N>
  void read(Eigen::Matrix<Scalar, N, 1>& value, Allowed allowed) {
    auto parts = items();
    if (parts.size() != N) fail_at(where(), "{}has {} numbers, {} are needed", context(), parts.size(), N);
    for (int i = 0; i < N; ++i) parts[i].read(value[i], allowed);
  }

  template <typename T>
  void read(std::vector<T>& value, Allowed allowed) {
    value.clear();
    for (YamlReader& item : items()) {
      T one{};
      item.read(one, allowed);
      value.push_back(std::move(one));
    }
  }

  template <typename T>
  void read(std::optional<T>& value, Allowed allowed) {
    T one{};
    read(one, allowed);
    value = std::move(one);
  }

  template <typename T>
  requires std::is_enum_v<T>
  void read(T& value, Allowed) {
    const std::string name = scalar("a name");
    std::vector<std::string> known;
    for (const auto& [known_name, known_value] : enum_names(T{})) {
      if (known_name == name) {
        value = known_value;
        return;
      }
      known.push_back(known_name);
    }
    refuse_name(name, known);
  }

  template <typename T>
  requires(std::is_class_v<T>) void read(T& value, Allowed allowed) {
    if constexpr (requires { read_value(*this, value, allowed); }) {
      read_value(*this, value, allowed);
    } else {
      read_struct(value);
    }
  }

  [[noreturn]] void refuse_name(const std::string& name, const std::vector<std::string>& known) const;

  std::shared_ptr<Node> node_;
};

/// Reads a whole file into a struct. @throws Error with file and line
template <typename T>
T read_yaml(const std::filesystem::path& file) {
  T value{};
  YamlReader::open(file).read_struct(value);
  return value;
}

/// Reads a text into a struct; `name` stands for the file in messages.
template <typename T>
T parse_yaml(const std::string& text, const std::string& name) {
  T value{};
  YamlReader::parse(text, name).read_struct(value);
  return value;
}

}  // namespace touchstone
