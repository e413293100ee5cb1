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
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <typeindex>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"

namespace touchstone {

/// The range that a number may have.
struct Allowed {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_included = true;
  bool high_included = true;

  static Allowed any() { return {}; }
  static Allowed above(double low) { return {.low = low, .low_included = false}; }
  static Allowed at_least(double low) { return {.low = low}; }
  static Allowed within(double low, double high) { return {.low = low, .high = high}; }
  /// low < value <= high
  static Allowed above_up_to(double low, double high) { return {.low = low, .high = high, .low_included = false}; }

  bool operator==(const Allowed&) const = default;
  /// Is the value within the bounds? NaN never is.
  bool holds(double value) const;
  std::string text() const;  ///< "above 0", "from 0 to 0.5"
};

/// A table of an enum's names, as `enum_names` returns it.
template <typename E>
using EnumNames = std::vector<std::pair<std::string, E>>;

/// A plain value in a file. A name is text.
using YamlScalar = std::variant<bool, std::int64_t, double, std::string>;

struct YamlMap;

/// A place in a YAML file that is being read: a map whose fields are asked for by name, or a value. Every mistake is an
/// Error with file, line, field, the value found and what is allowed.
class YamlReader {
 public:
  /// Parses a file whose root is a map. @throws Error with file and line
  static YamlReader open(const std::filesystem::path& file);
  /// Parses a text; `name` stands for the file in messages.
  static YamlReader parse(const std::string& text, const std::string& name);

  /// Reads the field `key`, which must be there.
  template <typename T>
  void required(const std::string& key, T& value, Allowed allowed = {}) {
    auto node = child(key, true);
    if (!node) refuse_missing(key);
    node->read(value, allowed);
  }

  /// Reads the field `key` if it's there, else leaves `value` as it is.
  template <typename T>
  void optional(const std::string& key, T& value, Allowed allowed = {}) {
    auto node = child(key, false);
    if (describing()) note_default(key, plain_value(value));
    if (node) node->read(value, allowed);
  }

  /// Reads the field `key`, which must be there and be one of `known`.
  std::string required_name(const std::string& key, const std::vector<std::string>& known);

  /// Refuses the map unless exactly one of these keys stands in it.
  void exactly_one_of(const std::vector<std::string>& keys);
  /// Refuses `key` if any of `others` stands in the map, too.
  void not_beside(const std::string& key, const std::vector<std::string>& others);

  /// Does the key stand in the map? From now on it counts as a known one.
  bool has(const std::string& key) const;
  /// Where the field `key` stands, or the map itself if it isn't there.
  SourceLocation where(const std::string& key) const;
  SourceLocation where() const;
  /// The folder of the file, against which relative paths in it are meant.
  std::filesystem::path folder() const;

  // For types that may stand in several forms: they have, in the place of `fields`, a function
  // `read_value(YamlReader& in, T& value, Allowed allowed)` that looks at what stands there.
  /// Does a list stand here?
  bool is_list() const;
  /// Does a map stand here?
  bool is_map() const;
  std::string text() const { return scalar("a number, a list or a file's name"); }
  /// The text, if it begins and ends so.
  std::optional<std::string> text_with(const std::string& begin, const std::string& end) const;
  /// The number that stands here. @throws Error if there is none, or one that isn't allowed
  double number(Allowed allowed) const;
  std::vector<double> numbers(Allowed allowed) const;  ///< of a list
  std::string context() const;                         ///< the field, for messages: "gel.thickness_mm: " or ""

  /// No file is read: `fields` is only asked what it would read (describe_yaml), and is given made-up values, again and
  /// again. So it must open no files that fields name, and its checks of values stand after its last field: what they
  /// throw ends the answer. Checks of which keys stand together are exactly_one_of and not_beside.
  bool describing() const;

  /// Reads this whole map into a struct by its `fields`, and refuses keys that it didn't ask for.
  template <typename T>
  void read_struct(T& value) {
    if (describing()) {
      return describe_struct(typeid(T), [](YamlReader& in) {
        T one{};
        fields(in, one);
      });
    }
    require_map();
    fields(*this, value);
    finish();
  }

 private:
  struct Node;
  explicit YamlReader(std::shared_ptr<Node> node) : node_(std::move(node)) {}

  template <typename T>
  friend std::shared_ptr<const YamlMap> describe_yaml();

  std::optional<YamlReader> child(const std::string& key, bool needed);
  std::vector<YamlReader> items(std::optional<int> length = {}) const;  ///< of a sequence; length: that it must have
  std::string scalar(const char* kind) const;
  void require_map() const;
  void finish() const;
  [[noreturn]] void refuse_missing(const std::string& key) const;
  void refuse_nearly(const std::string& key) const;

  static YamlReader description();
  std::shared_ptr<const YamlMap> described_map() const;
  void describe_struct(std::type_index type, const std::function<void(YamlReader&)>& ask) const;
  void describe_forms(const std::function<void()>& ask) const;
  void note_default(const std::string& key, std::optional<YamlScalar> value) const;
  /// Which of the names stands here.
  std::size_t name_index(const std::vector<std::string>& known) const;

  template <typename T>
  static std::optional<YamlScalar> plain_value(const T& value) {
    if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, double> || std::is_same_v<T, std::string>) {
      return value;
    } else if constexpr (std::is_integral_v<T>) {
      if (std::in_range<std::int64_t>(value)) return static_cast<std::int64_t>(value);
    } else if constexpr (std::is_enum_v<T>) {
      for (const auto& [name, known_value] : enum_names(T{})) {
        if (known_value == value) return name;
      }
    }
    return std::nullopt;
  }

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
    auto parts = items(N);
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
    const EnumNames<T> names = enum_names(T{});
    std::vector<std::string> known;
    for (const auto& [name, known_value] : names) known.push_back(name);
    value = names[name_index(known)].second;
  }

  template <typename T>
  requires(std::is_class_v<T>) void read(T& value, Allowed allowed) {
    if constexpr (requires { read_value(*this, value, allowed); }) {
      if (describing()) return describe_forms([&] { read_value(*this, value, allowed); });
      read_value(*this, value, allowed);
    } else {
      read_struct(value);
    }
  }

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

/// What may stand in a file that is read into a T (core/yaml_form.h), found by calling `fields` many times without a
/// file.
template <typename T>
std::shared_ptr<const YamlMap> describe_yaml() {
  YamlReader reader = YamlReader::description();
  T value{};
  reader.read_struct(value);
  return reader.described_map();
}

}  // namespace touchstone
