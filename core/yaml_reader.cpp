#include "core/yaml_reader.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>

#include "core/field_error.h"
#include "core/nearest_name.h"
#include "core/short_text.h"
#include "core/text_file.h"
#include "core/whole_file.h"
#include "core/yaml_description.h"

namespace touchstone {

bool Allowed::holds(double value) const {
  return (low_included ? value >= low : value > low) && (high_included ? value <= high : value < high);
}

std::string Allowed::text() const {
  const bool has_low = std::isfinite(low);
  const bool has_high = std::isfinite(high);
  if (has_low && has_high) {
    return fmt::format("{} {} {} {}", low_included ? "from" : "above", low, high_included ? "to" : "and below", high);
  }
  if (has_low) return fmt::format("{} {}", low_included ? "at least" : "above", low);
  if (has_high) return fmt::format("{} {}", high_included ? "at most" : "below", high);
  return "a finite number";
}

struct YamlReader::Node {
  YAML::Node yaml;
  std::string file;
  std::string path;                        // keys from the root, with dots
  mutable std::vector<std::string> asked;  // keys that some field asked for

  std::shared_ptr<YamlPlace> place;  // instead of all this, while describing
  static std::shared_ptr<Node> at(std::shared_ptr<YamlPlace> place) {
    auto node = std::make_shared<Node>();
    node->place = std::move(place);
    return node;
  }

  int empty_line = 0;  // line of the key, if nothing stands after it: YAML marks the next token

  /// Throws what is wrong with this field; the message begins with its path.
  template <typename... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    refuse_at(line(), path, fmt::format(format, std::forward<Args>(args)...));
  }
  [[noreturn]] void refuse_at(int at_line, const std::string& field, const std::string& message) const {
    throw FieldError({file, at_line}, field, (path.empty() ? "" : path + ": ") + message);
  }
  std::string path_of(const std::string& key) const { return path.empty() ? key : path + "." + key; }

  int line() const { return empty_line > 0 ? empty_line : yaml.Mark().is_null() ? 0 : yaml.Mark().line + 1; }
};

namespace {

template <typename T>
std::optional<T> whole_number(const std::string& text) {
  T value{};
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  if (begin != end && begin != text.data() && *begin == '-') return std::nullopt;  // "+-5"
  const auto result = std::from_chars(begin, end, value);
  if (begin == end || result.ec != std::errc() || result.ptr != end) return std::nullopt;
  return value;
}

/// Stops at what a second document holds.
class OneDocument : public YAML::EventHandler {
 public:
  struct Second {
    YAML::Mark mark;
  };

  void OnDocumentStart(const YAML::Mark&) override { ++documents_; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { stop_in_second(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { stop_in_second(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t, const std::string&) override {
    stop_in_second(mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    stop_in_second(mark);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    stop_in_second(mark);
  }
  void OnMapEnd() override {}

 private:
  void stop_in_second(const YAML::Mark& mark) const {
    if (documents_ > 1) throw Second{mark};
  }

  int documents_ = 0;
};

/// Reading takes some 200 bytes of memory for each byte of a list of numbers.
void refuse_too_large(std::uintmax_t bytes, const std::string& name) {
  constexpr std::uintmax_t kMost = 4'000'000;
  if (bytes > kMost) throw Error({name, 0}, fmt::format("has {} bytes; a YAML file may have {}", bytes, kMost));
}

/// The text's one document. Not by YAML::LoadAll, which makes documents until memory is gone of what can't begin one
/// (", a").
YAML::Node only_document(const std::string& text, const std::string& name) {
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    OneDocument one;
    while (parser.HandleNextDocument(one)) {
    }
    return YAML::Load(text);
  } catch (const OneDocument::Second& second) {
    throw Error({name, second.mark.is_null() ? 0 : second.mark.line + 1}, "a second document begins here; one is read");
  } catch (const YAML::Exception& error) {
    throw Error({name, error.mark.is_null() ? 0 : error.mark.line + 1}, "isn't YAML: " + error.msg);
  }
}

}  // namespace

YamlReader YamlReader::open(const std::filesystem::path& file) {
  std::error_code ignored;  // reading says what is wrong
  if (std::filesystem::is_regular_file(file, ignored)) {
    refuse_too_large(std::filesystem::file_size(file, ignored), file.string());
  }
  return parse(read_whole_file(file), file.string());
}

YamlReader YamlReader::parse(const std::string& text, const std::string& name) {
  refuse_too_large(text.size(), name);
  auto node = std::make_shared<Node>();
  node->file = name;
  node->yaml = only_document(text, name);
  YamlReader reader(node);
  reader.require_map();
  return reader;
}

bool YamlReader::describing() const {
  return node_->place != nullptr;
}

YamlReader YamlReader::description() {
  return YamlReader(Node::at(std::make_shared<YamlPlace>(std::make_shared<YamlPlace::Known>())));
}

std::shared_ptr<const YamlMap> YamlReader::described_map() const {
  const std::vector<YamlForm> forms = node_->place->asked();
  TS_ASSERT(forms.size() == 1 && forms[0].map != nullptr);
  return forms[0].map;
}

void YamlReader::describe_struct(std::type_index type, const std::function<void(YamlReader&)>& ask) const {
  node_->place->map(type, [&ask](std::shared_ptr<YamlPlace> place) {
    YamlReader in(Node::at(std::move(place)));
    ask(in);
  });
}

void YamlReader::describe_forms(const std::function<void()>& ask) const {
  node_->place->forms(ask);
}

void YamlReader::note_default(const std::string& key, std::optional<YamlScalar> value) const {
  node_->place->note_default(key, std::move(value));
}

bool YamlReader::has(const std::string& key) const {
  if (describing()) return node_->place->has(key);
  node_->asked.push_back(key);
  const YAML::Node& map = node_->yaml;
  return map.IsMap() && map[key].IsDefined();
}

SourceLocation YamlReader::where() const {
  return {node_->file, node_->line()};
}

SourceLocation YamlReader::where(const std::string& key) const {
  const YAML::Node& map = node_->yaml;
  if (map.IsMap()) {
    const YAML::Node value = map[key];
    if (value.IsDefined() && !value.Mark().is_null()) return {node_->file, value.Mark().line + 1};
  }
  return where();
}

std::filesystem::path YamlReader::folder() const {
  return std::filesystem::path(node_->file).parent_path();
}

std::string YamlReader::context() const {
  return node_->path.empty() ? "" : node_->path + ": ";
}

void YamlReader::require_map() const {
  if (!node_->yaml.IsMap()) node_->refuse("a map of fields is needed here");
}

std::optional<YamlReader> YamlReader::child(const std::string& key, bool needed) {
  if (describing()) {
    auto place = node_->place->child(key, needed);
    if (place == nullptr) return std::nullopt;
    return YamlReader(Node::at(std::move(place)));
  }
  node_->asked.push_back(key);
  const YAML::Node& map = node_->yaml;
  const YAML::Node value = map[key];
  if (!value.IsDefined()) return std::nullopt;
  auto node = std::make_shared<Node>();
  node->yaml = value;
  node->file = node_->file;
  node->path = node_->path_of(key);
  if (value.IsNull()) {
    for (const auto& entry : map) {
      if (entry.first.IsScalar() && entry.first.Scalar() == key) node->empty_line = entry.first.Mark().line + 1;
    }
  }
  return YamlReader(node);
}

std::vector<YamlReader> YamlReader::items(std::optional<int> length) const {
  if (describing()) {
    std::vector<YamlReader> described;
    for (auto& place : node_->place->items(length)) described.push_back(YamlReader(Node::at(std::move(place))));
    return described;
  }
  if (!node_->yaml.IsSequence()) node_->refuse("a list is needed here");
  std::vector<YamlReader> result;
  for (std::size_t i = 0; i < node_->yaml.size(); ++i) {
    auto node = std::make_shared<Node>();
    node->yaml = node_->yaml[i];
    node->file = node_->file;
    node->path = fmt::format("{}[{}]", node_->path, i);
    result.push_back(YamlReader(node));
  }
  return result;
}

bool YamlReader::is_list() const {
  if (describing()) return node_->place->shape() == YamlPlace::Shape::list;
  return node_->yaml.IsSequence();
}

bool YamlReader::is_map() const {
  if (describing()) return node_->place->shape() == YamlPlace::Shape::map;
  return node_->yaml.IsMap();
}

std::vector<double> YamlReader::numbers(Allowed allowed) const {
  std::vector<double> all;
  for (const YamlReader& item : items()) all.push_back(item.number(allowed));
  return all;
}

std::optional<std::string> YamlReader::text_with(const std::string& begin, const std::string& end) const {
  if (describing()) {
    node_->place->text(begin, end);
    return std::nullopt;
  }
  if (!node_->yaml.IsScalar()) return std::nullopt;
  const std::string& text = node_->yaml.Scalar();
  if (!text.starts_with(begin) || !text.ends_with(end)) return std::nullopt;
  return text;
}

std::string YamlReader::scalar(const char* kind) const {
  if (describing()) return node_->place->text();
  if (!node_->yaml.IsScalar()) node_->refuse("{} is needed here", kind);
  const std::string& text = node_->yaml.Scalar();
  // Comments may have any bytes; what is read is written into manifests and handed to Python.
  if (!is_utf8(text)) node_->refuse("'{}' isn't UTF-8; save the file as UTF-8", short_text(text));
  return text;
}

double YamlReader::number(Allowed allowed) const {
  if (describing()) return node_->place->number(allowed);
  const std::string text = scalar("a number");
  const auto value = whole_number<double>(text);
  if (!value || !std::isfinite(*value)) {
    node_->refuse("'{}' isn't a finite number; allowed is {}", short_text(text), allowed.text());
  }
  if (!allowed.holds(*value)) node_->refuse("{} is not allowed; allowed is {}", short_text(text), allowed.text());
  return *value;
}

std::int64_t YamlReader::integer(Allowed allowed) const {
  if (describing()) return node_->place->integer(allowed);
  const std::string text = scalar("a whole number");
  const auto value = whole_number<std::int64_t>(text);
  if (!value) node_->refuse("'{}' isn't a whole number", short_text(text));
  if (!allowed.holds(static_cast<double>(*value))) {
    node_->refuse("{} is not allowed; allowed is {}", short_text(text), allowed.text());
  }
  return *value;
}

int YamlReader::small_integer(Allowed allowed) const {
  const std::int64_t value = integer(allowed);
  using Limits = std::numeric_limits<int>;
  if (value < Limits::min() || value > Limits::max()) {
    node_->refuse("{} is not allowed; allowed is from {} to {}", value, Limits::min(), Limits::max());
  }
  return static_cast<int>(value);
}

std::uint64_t YamlReader::unsigned_integer(Allowed allowed) const {
  if (describing()) {
    if (allowed.low < 0.0) allowed.low = 0.0;
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, node_->place->integer(allowed)));
  }
  const std::string text = scalar("a whole number");
  const auto value = whole_number<std::uint64_t>(text);
  if (!value) node_->refuse("'{}' isn't a whole number from 0 up", short_text(text));
  if (!allowed.holds(static_cast<double>(*value))) {
    node_->refuse("{} is not allowed; allowed is {}", short_text(text), allowed.text());
  }
  return *value;
}

void YamlReader::read(bool& value, Allowed) {
  if (describing()) {
    value = node_->place->boolean();
    return;
  }
  const std::string text = scalar("true or false");
  if (text != "true" && text != "false") node_->refuse("'{}' is neither true nor false", short_text(text));
  value = text == "true";
}

void YamlReader::finish() const {
  std::vector<std::string> seen;
  for (const auto& entry : node_->yaml) {
    const int line = entry.first.Mark().is_null() ? 0 : entry.first.Mark().line + 1;
    if (!entry.first.IsScalar()) node_->refuse_at(line, node_->path, "a key must be a plain word");
    const std::string key = entry.first.Scalar();
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) {
      node_->refuse_at(line, node_->path_of(key), fmt::format("'{}' stands here a second time", short_text(key)));
    }
    seen.push_back(key);
    if (std::find(node_->asked.begin(), node_->asked.end(), key) == node_->asked.end()) {
      node_->refuse_at(line, node_->path_of(key),
                       fmt::format("unknown key '{}'{}", short_text(key), did_you_mean(key, node_->asked)));
    }
  }
}

void YamlReader::refuse_nearly(const std::string& key) const {
  for (const auto& entry : node_->yaml) {
    if (!entry.first.IsScalar()) continue;
    const std::string there = entry.first.Scalar();
    const std::array<std::string, 1> wanted = {key};
    if (std::find(node_->asked.begin(), node_->asked.end(), there) == node_->asked.end() &&
        nearest_name(there, wanted)) {
      const int line = entry.first.Mark().is_null() ? 0 : entry.first.Mark().line + 1;
      node_->refuse_at(line, node_->path_of(there),
                       fmt::format("unknown key '{}'{}", short_text(there), did_you_mean(there, wanted)));
    }
  }
}

void YamlReader::refuse_missing(const std::string& key) const {
  refuse_nearly(key);
  node_->refuse_at(node_->line(), node_->path_of(key), fmt::format("'{}' is missing", key));
}

void YamlReader::exactly_one_of(const std::vector<std::string>& keys) {
  if (describing()) return node_->place->rule({.kind = YamlRule::Kind::exactly_one, .keys = keys});
  std::vector<std::string> there;
  for (const std::string& key : keys) {
    if (has(key)) there.push_back(key);
  }
  if (there.size() == 1) return;
  if (there.empty()) {
    for (const std::string& key : keys) refuse_nearly(key);
    node_->refuse("none of {} stands here; exactly one is needed", fmt::join(keys, ", "));
  }
  node_->refuse("{} stand here together; exactly one of {} is needed", fmt::join(there, " and "),
                fmt::join(keys, ", "));
}

void YamlReader::not_beside(const std::string& key, const std::vector<std::string>& others) {
  for (const std::string& other : others) {
    if (describing()) {
      node_->place->rule({.kind = YamlRule::Kind::not_both, .keys = {key, other}});
    } else if (has(key) && has(other)) {
      node_->refuse_at(where(key).line, node_->path_of(key), fmt::format("{}: can't stand beside {}", key, other));
    }
  }
}

std::string YamlReader::required_name(const std::string& key, const std::vector<std::string>& known) {
  auto node = child(key, true);
  if (!node) refuse_missing(key);
  return known[node->name_index(known)];
}

std::size_t YamlReader::name_index(const std::vector<std::string>& known) const {
  if (describing()) return node_->place->name(known);
  const std::string name = scalar("a name");
  auto found = std::find(known.begin(), known.end(), name);
  // Programs of YAML 1.1 take "on" and "off" for truth values and write them so.
  if (found == known.end() && name == "true") found = std::find(known.begin(), known.end(), "on");
  if (found == known.end() && name == "false") found = std::find(known.begin(), known.end(), "off");
  if (found == known.end()) {
    node_->refuse("'{}' is not known{}; allowed is one of: {}", short_text(name), did_you_mean(name, known),
                  fmt::join(known, ", "));
  }
  return static_cast<std::size_t>(found - known.begin());
}

}  // namespace touchstone
