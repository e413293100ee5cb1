#pragma once
// How YamlReader finds out what a `fields` function reads: the function is called many times without a file, on a place
// that hands out made-up values and writes down what it was asked. Which fields are there, and their values where these
// are few (names, true and false, zero), is changed one at a time; where that changes which other fields are asked for,
// the description branches. Used by yaml_reader.cpp alone.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <typeindex>
#include <vector>

#include "core/yaml_form.h"

namespace touchstone {

class YamlPlace;

/// What is decided about a field in one call.
struct YamlPick {
  bool present = false;
  int value = 0;  ///< which of its values, by number
};
/// By the path of a field: what stands there in this call.
using YamlPicks = std::map<std::string, YamlPick>;

/// What one call asked for, in order.
struct YamlCall {
  /// One question of a `fields` function about a key.
  struct Asked {
    std::string key;
    bool read = false;                 ///< else it was only asked whether it is there
    bool required = false;             ///< it was read as one that must be there
    std::shared_ptr<YamlPlace> place;  ///< if it was there
    std::optional<YamlScalar> standard;
  };
  const YamlPicks* picks = nullptr;
  int round = 0;  ///< made-up values differ from round to round; from the first one on also what isn't in `picks`
  std::vector<Asked> asked;
  std::vector<YamlRule> rules;
  bool stopped = false;  ///< by a check

  Asked& entry(const std::string& key);
  const Asked* find(const std::string& key) const;
};

/// A place in the file that isn't there.
class YamlPlace {
 public:
  /// What the reading function took this place for.
  enum class Shape { scalar, list, map };
  /// Calls `fields` on a place that is a map.
  using Ask = std::function<void(std::shared_ptr<YamlPlace>)>;
  /// Types whose fields are already described: a type within itself is described once.
  using Known = std::map<std::type_index, std::shared_ptr<const YamlMap>>;

  explicit YamlPlace(std::shared_ptr<Known> known) : known_(std::move(known)) {}

  double number(Allowed allowed);
  std::int64_t integer(Allowed allowed);
  bool boolean();
  std::string text(const std::string& begin = "", const std::string& end = "");
  std::size_t name(const std::vector<std::string>& names);
  std::vector<std::shared_ptr<YamlPlace>> items(std::optional<int> length);

  Shape shape() const { return shape_; }
  void forms(const std::function<void()>& ask);
  void map(std::type_index type, const Ask& ask);

  // Of a map.
  bool has(const std::string& key);
  std::shared_ptr<YamlPlace> child(const std::string& key, bool needed);
  void note_default(const std::string& key, std::optional<YamlScalar> value);
  void rule(YamlRule rule);

  /// What was asked for here.
  std::vector<YamlForm> asked() const;
  /// How many values a caller can be given that may matter to it.
  int values() const { return values_; }

 private:
  struct Items {
    std::optional<int> length;
    std::vector<std::shared_ptr<YamlPlace>> places;
  };
  std::shared_ptr<YamlPlace> inner(const std::string& name) const;
  int choose(int values);
  double made_up(Allowed allowed);
  YamlCall call(const YamlPicks& picks, int round, const Ask& ask) const;
  YamlMap explore(const YamlPicks& fixed, const Ask& ask, int depth) const;

  std::shared_ptr<Known> known_;
  std::vector<YamlForm> forms_;
  std::vector<Items> items_;
  Shape shape_ = Shape::scalar;
  std::string name_;  // makes its values differ from those of other places
  int round_ = 0;
  int value_ = 0;
  bool offers_ = true;  // values to choose from
  int values_ = 1;
  YamlCall* call_ = nullptr;  // while `fields` reads this as a map
};

}  // namespace touchstone
