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

  /// The entry of a key, made if it was never asked for.
  Asked& entry(const std::string& key);
  /// Null if it was never asked for.
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

  /// Notes that a number was read, and gives one that is allowed; so for the functions below.
  double number(Allowed allowed);
  /// A whole number.
  std::int64_t integer(Allowed allowed);
  /// True or false.
  bool boolean();
  /// A text that begins and ends so.
  std::string text(const std::string& begin = "", const std::string& end = "");
  /// The number of one of these names.
  std::size_t name(const std::vector<std::string>& names);
  /// The items of a list, which is as long as `length` if that is given.
  std::vector<std::shared_ptr<YamlPlace>> items(std::optional<int> length);

  Shape shape() const { return shape_; }
  /// Notes that any of the forms that `ask` reads may stand here.
  void forms(const std::function<void()>& ask);
  /// Notes that a map stands here, with the fields that `ask` reads for the type.
  void map(std::type_index type, const Ask& ask);

  // Of a map.
  /// Of a map, as the functions below: notes that a key was asked for, and says whether this call has it.
  bool has(const std::string& key);
  /// What stands behind the key; null if it isn't there. `needed`: it must be.
  std::shared_ptr<YamlPlace> child(const std::string& key, bool needed);
  /// What the key's value is when it is left out.
  void note_default(const std::string& key, std::optional<YamlScalar> value);
  /// Notes which keys can stand together.
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
