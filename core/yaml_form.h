#pragma once
// What may stand in a YAML file, as plain data. `describe_yaml` (core/yaml_reader.h) finds it by asking the very
// `fields` functions that read files, so there is no second list of keys.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/yaml_reader.h"

namespace touchstone {

/// One form that a value may have.
struct YamlForm {
  /// What stands there; `name` is a text out of a fixed list.
  enum class Kind { number, integer, boolean, text, name, list, map };
  Kind kind = Kind::text;
  Allowed allowed = {};                     ///< number, integer; without the bounds that depend on other fields
  std::vector<std::string> names = {};      ///< name: the known ones
  std::string begin = {}, end = {};         ///< text: what it begins and ends with
  std::vector<YamlForm> items = {};         ///< list: an item has one of these
  std::optional<int> length = {};           ///< list: if it is always the same
  std::shared_ptr<const YamlMap> map = {};  ///< one object for each struct

  bool operator==(const YamlForm&) const = default;
};

/// A key of a map, and what may stand behind it.
struct YamlField {
  std::string key;
  bool required = false;
  std::vector<YamlForm> forms = {};  ///< it has one of these
  std::optional<YamlScalar> standard =
      {};  ///< what it is when left out, where that is plain and doesn't depend on others

  bool operator==(const YamlField&) const = default;
};

/// Which keys can stand together.
struct YamlRule {
  /// Exactly one of the keys must be there, or at most one of two may be.
  enum class Kind { exactly_one, not_both };
  Kind kind = Kind::exactly_one;
  std::vector<std::string> keys;

  bool operator==(const YamlRule&) const = default;
};

/// A case of a field, on which it depends what other fields there are.
struct YamlCase {
  /// Is the field absent, there, there with this value, or there with another one?
  enum class Kind { absent, present, equal, other };  ///< other: there, but not equal
  Kind kind = Kind::absent;
  YamlScalar value = false;  ///< equal, other

  bool operator==(const YamlCase&) const = default;
};

struct YamlBranch;

/// The fields of a struct: either a list, or branches by the cases of one field.
struct YamlMap {
  std::vector<YamlField> fields;
  std::vector<YamlRule> rules;
  std::optional<YamlField> by;  ///< what the branches go by; they don't list it again
  std::vector<YamlBranch> branches;

  bool operator==(const YamlMap&) const = default;
};

/// The fields that there are in some cases of the field YamlMap::by.
struct YamlBranch {
  std::vector<YamlCase> cases;  ///< any of them
  YamlMap map;

  bool operator==(const YamlBranch&) const = default;
};

}  // namespace touchstone
