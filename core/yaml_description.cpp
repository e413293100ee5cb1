#include "core/yaml_description.h"

#include <algorithm>
#include <cmath>

namespace touchstone {
namespace {

constexpr int kRounds = 32;   // of calls with other values, to see which bounds depend on them
constexpr int kDeepest = 12;  // branches within branches; more mean that they multiply

/// From 0 to 1, evenly, by its arguments alone.
double even(const std::string& name, int round) {
  std::uint64_t hash = 1469598103934665603u + static_cast<std::uint64_t>(round);  // FNV-1a, then mixed
  for (const char letter : name) hash = (hash ^ static_cast<unsigned char>(letter)) * 1099511628211u;
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
  hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
  return static_cast<double>((hash ^ (hash >> 31)) >> 11) * 0x1p-53;
}

void add_new(std::vector<YamlForm>& forms, const YamlForm& form) {
  if (std::find(forms.begin(), forms.end(), form) == forms.end()) forms.push_back(form);
}

/// The forms but for their bounds.
std::vector<YamlForm> without_bounds(std::vector<YamlForm> forms) {
  for (YamlForm& form : forms) {
    form.allowed = {};
    form.items = without_bounds(form.items);
  }
  return forms;
}

/// Drops the bounds of `forms` that are others in `seen`, since they depend on values.
void merge(std::vector<YamlForm>& forms, const std::vector<YamlForm>& seen) {
  for (const YamlForm& form : seen) {
    const auto plain = without_bounds({form});
    const auto same = std::find_if(forms.begin(), forms.end(),
                                   [&](const YamlForm& known) { return without_bounds({known}) == plain; });
    if (same == forms.end()) {
      forms.push_back(form);
      continue;
    }
    const Allowed any;
    if (same->allowed.low != form.allowed.low || same->allowed.low_included != form.allowed.low_included) {
      same->allowed.low = any.low;
      same->allowed.low_included = true;
    }
    if (same->allowed.high != form.allowed.high || same->allowed.high_included != form.allowed.high_included) {
      same->allowed.high = any.high;
      same->allowed.high_included = true;
    }
    merge(same->items, form.items);
  }
}

/// Whether the calls ask for other fields than `key`, or otherwise.
bool differ(const YamlCall& base, const YamlCall& other, const std::string& key, bool bounds) {
  for (const YamlCall::Asked& asked : other.asked) {
    if (asked.key == key || !asked.read) continue;
    const YamlCall::Asked* before = base.find(asked.key);
    if (before == nullptr || !before->read || before->required != asked.required) return true;
    if (before->place == nullptr || asked.place == nullptr) continue;
    const auto then = before->place->asked();
    const auto now = asked.place->asked();
    if (bounds ? then != now : without_bounds(then) != without_bounds(now)) return true;
  }
  // What is missing behind a stopped call's last field says nothing.
  const YamlCall::Asked* last = other.asked.empty() ? nullptr : base.find(other.asked.back().key);
  const YamlCall::Asked* end = base.asked.data() + base.asked.size();
  const YamlCall::Asked* reached = !other.stopped ? end : last == nullptr ? base.asked.data() : last + 1;
  for (const YamlCall::Asked* asked = base.asked.data(); asked != reached; ++asked) {
    if (asked->key == key || !asked->read) continue;
    const YamlCall::Asked* after = other.find(asked->key);
    if (after == nullptr || !after->read) return true;
  }
  return reached == end && base.rules != other.rules;
}

/// Whether the maps differ in nothing but defaults.
bool same_but_defaults(const YamlMap& left, const YamlMap& right) {
  const auto same_field = [](const YamlField& a, const YamlField& b) {
    return a.key == b.key && a.required == b.required && a.forms == b.forms;
  };
  const auto same_branch = [](const YamlBranch& a, const YamlBranch& b) {
    return a.cases == b.cases && same_but_defaults(a.map, b.map);
  };
  return left.rules == right.rules && left.by.has_value() == right.by.has_value() &&
         (!left.by || same_field(*left.by, *right.by)) && std::ranges::equal(left.fields, right.fields, same_field) &&
         std::ranges::equal(left.branches, right.branches, same_branch);
}

/// Drops the defaults of `map` that are others in `seen`, which is the same else.
void merge_defaults(YamlMap& map, const YamlMap& seen) {
  if (map.by && map.by->standard != seen.by->standard) map.by->standard.reset();
  for (std::size_t k = 0; k < map.fields.size(); ++k) {
    if (map.fields[k].standard != seen.fields[k].standard) map.fields[k].standard.reset();
  }
  for (std::size_t k = 0; k < map.branches.size(); ++k) merge_defaults(map.branches[k].map, seen.branches[k].map);
}

YamlCase case_of(const YamlPick& pick, const std::vector<YamlForm>& forms, int values) {
  if (!pick.present) return {};
  if (values == 1 || forms.empty()) return {.kind = YamlCase::Kind::present};
  const YamlForm& form = forms.front();
  if (form.kind == YamlForm::Kind::name) {
    return {.kind = YamlCase::Kind::equal, .value = form.names.at(static_cast<std::size_t>(pick.value))};
  }
  if (form.kind == YamlForm::Kind::boolean) return {.kind = YamlCase::Kind::equal, .value = pick.value == 1};
  return {.kind = pick.value == 1 ? YamlCase::Kind::equal : YamlCase::Kind::other, .value = std::int64_t{0}};
}

}  // namespace

YamlCall::Asked& YamlCall::entry(const std::string& key) {
  for (Asked& one : asked) {
    if (one.key == key) return one;
  }
  asked.emplace_back().key = key;
  return asked.back();
}

const YamlCall::Asked* YamlCall::find(const std::string& key) const {
  for (const Asked& one : asked) {
    if (one.key == key) return &one;
  }
  return nullptr;
}

std::shared_ptr<YamlPlace> YamlPlace::inner(const std::string& name) const {
  auto place = std::make_shared<YamlPlace>(known_);
  place->name_ = name_ + "." + name;
  place->round_ = round_;
  place->offers_ = offers_;
  return place;
}

int YamlPlace::choose(int values) {
  if (!offers_) return 0;
  values_ = std::max(values_, values);
  if (value_ >= 0) return std::min(value_, values - 1);
  return std::min(static_cast<int>(even(name_ + "?", round_) * values), values - 1);
}

double YamlPlace::made_up(Allowed allowed) {
  if (allowed.holds(0.0) && choose(2) == 1) return 0.0;
  constexpr double kDecades = 4.0;  // 0.01 to 100
  const double part = even(name_, round_);
  const double offset = std::pow(10.0, kDecades * (part - 0.5));
  const bool low = std::isfinite(allowed.low);
  const bool high = std::isfinite(allowed.high);
  if (low && high) return allowed.low + std::max(0.0, allowed.high - allowed.low) * std::max(part, 1e-6);
  return low ? allowed.low + offset : high ? allowed.high - offset : part < 0.5 ? -offset : offset;
}

double YamlPlace::number(Allowed allowed) {
  add_new(forms_, {.kind = YamlForm::Kind::number, .allowed = allowed});
  return made_up(allowed);
}

std::int64_t YamlPlace::integer(Allowed allowed) {
  add_new(forms_, {.kind = YamlForm::Kind::integer, .allowed = allowed});
  constexpr double kLargest = 1e9;
  return static_cast<std::int64_t>(std::clamp(std::ceil(made_up(allowed)), -kLargest, kLargest));
}

bool YamlPlace::boolean() {
  add_new(forms_, {.kind = YamlForm::Kind::boolean});
  return choose(2) == 1;
}

std::string YamlPlace::text(const std::string& begin, const std::string& end) {
  add_new(forms_, {.kind = YamlForm::Kind::text, .begin = begin, .end = end});
  return "text";
}

std::size_t YamlPlace::name(const std::vector<std::string>& names) {
  add_new(forms_, {.kind = YamlForm::Kind::name, .names = names});
  return static_cast<std::size_t>(choose(static_cast<int>(names.size())));
}

std::vector<std::shared_ptr<YamlPlace>> YamlPlace::items(std::optional<int> length) {
  Items items{length, {}};
  for (int k = 0; k < length.value_or(1); ++k) {
    items.places.push_back(inner(std::to_string(k)));
    items.places.back()->offers_ = false;
  }
  items_.push_back(items);
  return items.places;
}

void YamlPlace::forms(const std::function<void()>& ask) {
  offers_ = false;
  for (const Shape shape : {Shape::list, Shape::map, Shape::scalar}) {
    shape_ = shape;
    try {
      ask();
    } catch (const Error&) {  // checks of values that were made up
    }
  }
}

void YamlPlace::map(std::type_index type, const Ask& ask) {
  auto known = known_->find(type);
  if (known == known_->end()) {
    known = known_->emplace(type, std::make_shared<const YamlMap>(explore({}, ask, 0))).first;
  }
  add_new(forms_, {.kind = YamlForm::Kind::map, .map = known->second});
}

bool YamlPlace::has(const std::string& key) {
  TS_ASSERT(call_ != nullptr);
  call_->entry(key);
  const auto pick = call_->picks->find(key);
  if (pick != call_->picks->end()) return pick->second.present;
  return call_->round > 0 && even(key + "!", call_->round) < 0.5;
}

std::shared_ptr<YamlPlace> YamlPlace::child(const std::string& key, bool needed) {
  const bool there = has(key) || needed;
  YamlCall::Asked& asked = call_->entry(key);
  asked.required = asked.required || needed;
  asked.read = true;
  if (!there) return nullptr;
  if (asked.place == nullptr) asked.place = inner(key);
  asked.place->round_ = call_->round;
  asked.place->offers_ = true;
  const auto pick = call_->picks->find(key);
  asked.place->value_ = pick != call_->picks->end() ? pick->second.value : call_->round > 0 ? -1 : 0;
  return asked.place;
}

void YamlPlace::note_default(const std::string& key, std::optional<YamlScalar> value) {
  call_->entry(key).standard = std::move(value);
}

void YamlPlace::rule(YamlRule rule) {
  TS_ASSERT(call_ != nullptr);
  call_->rules.push_back(std::move(rule));
}

std::vector<YamlForm> YamlPlace::asked() const {
  std::vector<YamlForm> all = forms_;
  for (const Items& list : items_) {
    YamlForm form{.kind = YamlForm::Kind::list, .length = list.length};
    for (const auto& place : list.places) {
      for (const YamlForm& item : place->asked()) add_new(form.items, item);
    }
    add_new(all, form);
  }
  return all;
}

YamlCall YamlPlace::call(const YamlPicks& picks, int round, const Ask& ask) const {
  YamlCall call;
  call.picks = &picks;
  call.round = round;
  auto place = std::make_shared<YamlPlace>(known_);
  place->call_ = &call;
  place->shape_ = Shape::map;
  try {
    ask(place);
  } catch (const Error&) {  // checks of values that were made up
    call.stopped = true;
  }
  call.picks = nullptr;
  return call;
}

YamlMap YamlPlace::explore(const YamlPicks& fixed, const Ask& ask, int depth) const {
  TS_ASSERT(depth < kDeepest);
  const auto with = [&](const std::string& key, YamlPick pick) {
    YamlPicks picks = fixed;
    picks[key] = pick;
    return picks;
  };
  const YamlCall base = call(fixed, 0, ask);
  std::vector<YamlField> fields;
  for (const YamlCall::Asked& asked : base.asked) {
    if (fixed.contains(asked.key)) continue;
    // Every other case of this field alone.
    const YamlCall there = call(with(asked.key, {.present = true}), 0, ask);
    const YamlCall::Asked* found = there.find(asked.key);
    if (!asked.read && (found == nullptr || !found->read)) found = nullptr;
    YamlField field{.key = asked.key, .required = asked.required, .standard = asked.standard};
    int values = 1;
    if (found != nullptr && found->place != nullptr) {
      field.forms = found->place->asked();
      values = found->place->values();
    }
    bool matters = !asked.required && differ(base, there, asked.key, false);
    std::vector<YamlPick> picks;
    if (!asked.required) picks.push_back({.present = false});
    for (int value = 0; value < values; ++value) {
      picks.push_back({.present = true, .value = value});
      const bool names = field.forms.empty() || field.forms.front().kind == YamlForm::Kind::name ||
                         field.forms.front().kind == YamlForm::Kind::boolean;
      matters = matters || (value > 0 && differ(there, call(with(asked.key, picks.back()), 0, ask), asked.key, names));
    }
    if (!matters) {
      if (found != nullptr) fields.push_back(std::move(field));
      continue;
    }
    for (int round = 1; round <= kRounds; ++round) {
      const YamlCall other = call(with(asked.key, {.present = true}), round, ask);
      const YamlCall::Asked* again = other.find(asked.key);
      if (again != nullptr && again->place != nullptr) merge(field.forms, again->place->asked());
    }
    YamlMap split;
    for (const YamlPick& pick : picks) {
      const YamlMap map = explore(with(asked.key, pick), ask, depth + 1);
      const YamlCase one = case_of(pick, field.forms, values);
      const auto same = std::find_if(split.branches.begin(), split.branches.end(),
                                     [&](const YamlBranch& branch) { return same_but_defaults(branch.map, map); });
      if (same != split.branches.end()) {
        same->cases.push_back(one);
        merge_defaults(same->map, map);
      } else {
        split.branches.push_back({{one}, map});
      }
    }
    split.by = std::move(field);
    return split;
  }
  // Other values, many at a time: bounds and defaults that depend on them aren't described.
  for (int round = 1; round <= kRounds; ++round) {
    const YamlCall other = call(fixed, round, ask);
    for (const YamlCall::Asked& asked : other.asked) {
      if (!asked.read || fixed.contains(asked.key)) continue;
      auto known =
          std::find_if(fields.begin(), fields.end(), [&](const YamlField& field) { return field.key == asked.key; });
      if (known == fields.end()) {
        known = fields.insert(fields.end(), {.key = asked.key, .required = false, .standard = asked.standard});
      }
      if (asked.place != nullptr) merge(known->forms, asked.place->asked());
      if (known->standard != asked.standard) known->standard.reset();
    }
    if (other.stopped) continue;
    for (YamlField& field : fields) {
      const YamlCall::Asked* asked = other.find(field.key);
      if (asked == nullptr || !asked->read) field.required = false;
    }
  }
  return {.fields = fields, .rules = base.rules, .by = {}, .branches = {}};
}

}  // namespace touchstone
