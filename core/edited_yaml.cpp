#include "core/edited_yaml.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include "core/nearest_name.h"

namespace touchstone {
namespace {

/// One step along a path.
struct Step {
  std::string key;  // of a map; empty for a list's item
  int item = -1;    // of a list; -1 with an empty key: each
  std::size_t end;  // of the step's text
};

std::vector<Step> steps_of(const std::string& path, const SourceLocation& where) {
  std::vector<Step> steps;
  const auto broken = [&](const char* why) {
    fail_at(where, "path '{}' {}; a path is keys joined by dots, with [2] or [*] for items of lists", path, why);
  };
  std::size_t at = 0;
  while (at < path.size()) {
    if (path[at] == '[') {
      const std::size_t close = path.find(']', at);
      if (close == std::string::npos) broken("has a [ without a ]");
      const std::string inside = path.substr(at + 1, close - at - 1);
      int item = -1;
      if (inside != "*") {
        const auto read = std::from_chars(inside.data(), inside.data() + inside.size(), item);
        if (read.ec != std::errc() || read.ptr != inside.data() + inside.size() || item < 0) {
          broken("has something else than a number from 0 up or * in its brackets");
        }
      }
      at = close + 1;
      steps.push_back({"", item, at});
      continue;
    }
    if (path[at] == '.') {
      if (steps.empty()) broken("begins with a dot");
      ++at;
    } else if (!steps.empty()) {
      broken("has no dot");
    }
    const std::size_t end = std::min(path.find_first_of(".[", at), path.size());
    if (end == at) broken("has an empty key");
    steps.push_back({path.substr(at, end - at), -1, end});
    at = end;
  }
  if (steps.empty()) broken("is empty");
  return steps;
}

constexpr int kDeepest = 64;         // keys and lists in each other; an alias may hold itself
constexpr int kMostNodes = 100'000;  // a hundred aliases of aliases stand for more nodes than there are atoms

/// How many nodes stand at a place: two where an alias repeats one.
struct Marks {
  std::map<int, int> at;
  int nodes = 0;

  /// False if there are too many.
  bool count(const YAML::Node& node, int depth = 0) {
    if (depth > kDeepest) return true;
    if (++nodes > kMostNodes) return false;
    if (node.IsScalar()) {
      ++at[node.Mark().pos];
    } else if (node.IsSequence()) {
      for (const YAML::Node& item : node) {
        if (!count(item, depth + 1)) return false;
      }
    } else if (node.IsMap()) {
      for (const auto& entry : node) {
        if (!count(entry.second, depth + 1)) return false;
      }
    }
    return true;
  }
};

class Search {
 public:
  Search(const std::string& text, const std::string& name, const std::string& path, const SourceLocation& where)
      : text_(text), name_(name), path_(path), where_(where), steps_(steps_of(path, where)) {
    YAML::Node root;
    try {
      root = YAML::Load(text);
    } catch (const YAML::Exception& error) {
      throw Error({name, error.mark.is_null() ? 0 : error.mark.line + 1}, "isn't YAML: " + error.msg);
    }
    if (!marks_.count(root))
      throw Error({name, 0}, fmt::format("has more than {} values, aliases counted", kMostNodes));
    follow(root, 0, "");
  }

  std::vector<std::vector<YamlNumber>> groups;

 private:
  void follow(const YAML::Node& node, std::size_t number, const std::string& here) {
    if (number == steps_.size()) {
      groups.emplace_back();
      collect(node, here, groups.back());
      if (groups.back().empty()) fail_at(where_, "path '{}': '{}' of {} has no numbers", path_, here, name_);
      return;
    }
    const Step& step = steps_[number];
    if (!step.key.empty()) {
      if (!node.IsMap()) fail_at(where_, "path '{}': '{}' of {} has no keys", path_, here, name_);
      std::vector<std::string> known;
      for (const auto& entry : node) {
        if (!entry.first.IsScalar()) continue;
        known.push_back(entry.first.Scalar());
        if (known.back() == step.key) {
          follow(entry.second, number + 1, here.empty() ? step.key : here + "." + step.key);
          return;
        }
      }
      fail_at(where_, "path '{}': '{}' isn't in {}{}; a number that is to be changed must stand there", path_,
              path_.substr(0, step.end), name_, did_you_mean(step.key, known));
    }
    if (!node.IsSequence()) fail_at(where_, "path '{}': '{}' of {} isn't a list", path_, here, name_);
    const auto size = static_cast<int>(node.size());
    if (step.item >= size) {
      fail_at(where_, "path '{}': '{}' of {} has {} items, counted from 0", path_, here, name_, size);
    }
    for (int item = std::max(step.item, 0); item < (step.item < 0 ? size : step.item + 1); ++item) {
      follow(node[item], number + 1, fmt::format("{}[{}]", here, item));
    }
  }

  void collect(const YAML::Node& node, const std::string& here, std::vector<YamlNumber>& group, int depth = 0) const {
    if (static_cast<int>(steps_.size()) + depth > kDeepest) {  // marks_ don't count what is so deep
      fail_at(where_, "path '{}' stands more than {} keys and lists deep in {}, or holds itself", path_, kDeepest,
              name_);
    }
    if (node.IsSequence()) {
      for (std::size_t i = 0; i < node.size(); ++i) collect(node[i], fmt::format("{}[{}]", here, i), group, depth + 1);
      return;
    }
    const std::string word = node.IsScalar() ? node.Scalar() : "";
    const char* first = word.data() + (word.starts_with('+') ? 1 : 0);
    double value = 0.0;
    const auto read = std::from_chars(first, word.data() + word.size(), value);
    if (word.empty() || read.ec != std::errc() || read.ptr != word.data() + word.size() || !std::isfinite(value)) {
      fail_at(where_, "path '{}': '{}' of {} isn't a number", path_, here, name_);
    }
    const YAML::Mark mark = node.Mark();
    const auto begin = static_cast<std::size_t>(mark.is_null() ? 0 : mark.pos);
    // In UTF-16 places aren't those of the bytes.
    if (mark.is_null() || begin > text_.size() || text_.compare(begin, word.size(), word) != 0) {
      fail_at(where_, "path '{}': '{}' of {} must be written as a plain number", path_, here, name_);
    }
    if (marks_.at.at(mark.pos) > 1) {
      fail_at(where_, "path '{}': '{}' of {} is shared by an alias; write it out where it's used", path_, here, name_);
    }
    group.push_back({here, value, begin, word.size()});
  }

  const std::string& text_;
  const std::string& name_;
  const std::string& path_;
  const SourceLocation& where_;
  std::vector<Step> steps_;
  Marks marks_;
};

/// A part of a text and what is to stand there.
struct Edit {
  std::size_t begin, size;
  std::string text;
};

std::string edited(const std::string& text, std::vector<Edit> edits) {
  std::ranges::sort(edits, {}, &Edit::begin);
  std::string out;
  std::size_t at = 0;
  for (const Edit& edit : edits) {
    TS_ASSERT(edit.begin >= at && edit.begin + edit.size <= text.size());
    out.append(text, at, edit.begin - at);
    out += edit.text;
    at = edit.begin + edit.size;
  }
  out.append(text, at);
  return out;
}

std::string in_quotes(const std::string& word) {
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "''" : std::string(1, c);
  return out + "'";
}

/// An edit for each of the values that name files.
void move_files(const YAML::Node& node, const std::string& text, const std::filesystem::path& from,
                const std::filesystem::path& to, std::map<std::size_t, Edit>& edits, int depth = 0) {
  if (depth > kDeepest) return;
  if (node.IsMap()) {
    for (const auto& entry : node) move_files(entry.second, text, from, to, edits, depth + 1);
  } else if (node.IsSequence()) {
    for (const YAML::Node& item : node) move_files(item, text, from, to, edits, depth + 1);
  }
  if (!node.IsScalar() || node.Mark().is_null()) return;
  const std::string& word = node.Scalar();
  const std::filesystem::path named(word);
  std::error_code none;
  if (word.find('.') == std::string::npos || named.is_absolute() ||
      !std::filesystem::is_regular_file(from / named, none))
    return;
  const auto begin = static_cast<std::size_t>(node.Mark().pos);
  if (begin >= text.size()) return;
  const bool quoted = text[begin] == '\'' || text[begin] == '"';
  if (text.compare(begin + (quoted ? 1 : 0), word.size(), word) != 0) return;  // has escapes, or isn't in bytes
  edits[begin] = {begin, word.size() + (quoted ? 2 : 0),
                  in_quotes(std::filesystem::relative(from / named, to).string())};
}

}  // namespace

std::vector<std::vector<YamlNumber>> find_yaml_numbers(const std::string& text, const std::string& name,
                                                       const std::string& path, const SourceLocation& where) {
  return std::move(Search(text, name, path, where).groups);
}

std::string with_yaml_numbers(const std::string& text, const std::vector<std::pair<YamlNumber, double>>& numbers) {
  std::vector<Edit> edits;
  for (const auto& [number, value] : numbers) {
    TS_ASSERT(std::isfinite(value));
    edits.push_back({number.begin, number.size, fmt::format("{}", value)});
  }
  return edited(text, std::move(edits));
}

std::string with_yaml_files_from(const std::string& text, const std::filesystem::path& from,
                                 const std::filesystem::path& to) {
  std::map<std::size_t, Edit> found;  // an alias' value stands once in the text
  const YAML::Node root = YAML::Load(text);
  if (!Marks().count(root)) return text;
  move_files(root, text, from, to, found);
  std::vector<Edit> edits;
  for (const auto& [begin, edit] : found) edits.push_back(edit);
  return edited(text, std::move(edits));
}

}  // namespace touchstone
