#include "lab/schema/file_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/yaml_form.h"
#include "datasets/jobs/draw.h"
#include "datasets/jobs/job.h"
#include "lab/fit/unit_fit_spec.h"
#include "lab/studies/study.h"
#include "lab/vhs/palpation_spec.h"
#include "sim/scene/device.h"
#include "sim/scene/motion.h"
#include "sim/scene/object.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {
namespace {

using Json = nlohmann::ordered_json;
using Form = YamlForm;

struct Kind {
  const char* name;
  std::function<Json()> schema;
};

Json map_schema(const YamlMap& map);

/// Whole numbers without a point.
Json number(double value) {
  constexpr double kLargest = 9007199254740992.0;  // 2^53
  if (std::floor(value) == value && std::abs(value) <= kLargest) return static_cast<std::int64_t>(value);
  return value;
}

Json scalar(const YamlScalar& value) {
  if (const auto* real = std::get_if<double>(&value)) return number(*real);
  return std::visit([](const auto& one) { return Json(one); }, value);
}

/// A regular expression for this very text.
std::string escaped(const std::string& text) {
  std::string pattern;
  for (const char letter : text) {
    if (std::string_view("\\^$.|?*+()[]{}").find(letter) != std::string_view::npos) pattern += '\\';
    pattern += letter;
  }
  return pattern;
}

Json number_schema(const char* type, const Allowed& allowed) {
  Json schema = {{"type", type}};
  if (std::isfinite(allowed.low)) schema[allowed.low_included ? "minimum" : "exclusiveMinimum"] = number(allowed.low);
  if (std::isfinite(allowed.high))
    schema[allowed.high_included ? "maximum" : "exclusiveMaximum"] = number(allowed.high);
  return schema;
}

/// Where "on" and "off" are allowed, true and false are read as them.
Json with_truth_values(const std::vector<std::string>& names) {
  Json values = names;
  for (const auto& [name, value] : {std::pair("on", true), std::pair("off", false)}) {
    if (std::ranges::find(names, name) != names.end()) values.push_back(value);
  }
  return values;
}

Json forms_schema(const std::vector<Form>& forms);

Json form_schema(const Form& form) {
  switch (form.kind) {
    case Form::Kind::number:
      return number_schema("number", form.allowed);
    case Form::Kind::integer:
      return number_schema("integer", form.allowed);
    case Form::Kind::boolean:
      return {{"type", "boolean"}};
    case Form::Kind::name:
      return {{"enum", with_truth_values(form.names)}};
    case Form::Kind::text:
      // `name: 5` is text to the reader.
      if (form.begin.empty() && form.end.empty()) return {{"type", {"string", "number", "boolean"}}};
      return {{"type", "string"},
              {"pattern", (form.begin.empty() ? "" : "^" + escaped(form.begin)) +
                              (form.end.empty() ? "" : (form.begin.empty() ? "" : ".*") + escaped(form.end) + "$")}};
    case Form::Kind::list: {
      Json schema = {{"type", "array"}, {"items", forms_schema(form.items)}};
      if (form.length) {
        schema["minItems"] = *form.length;
        schema["maxItems"] = *form.length;
      }
      return schema;
    }
    case Form::Kind::map:
      return map_schema(*form.map);
  }
  TS_ASSERT(false);
  return {};
}

Json forms_schema(const std::vector<Form>& forms) {
  TS_ASSERT(!forms.empty());
  if (forms.size() == 1) return form_schema(forms.front());
  Json any = Json::array();
  for (const Form& form : forms) any.push_back(form_schema(form));
  return {{"anyOf", any}};
}

bool holds(const Form& form, const YamlScalar& value) {
  const bool whole = std::holds_alternative<std::int64_t>(value);
  switch (form.kind) {
    case Form::Kind::number:
    case Form::Kind::integer:
      return whole ? form.allowed.holds(static_cast<double>(std::get<std::int64_t>(value)))
                   : std::holds_alternative<double>(value) && form.allowed.holds(std::get<double>(value));
    case Form::Kind::boolean:
      return std::holds_alternative<bool>(value);
    case Form::Kind::name:
      return std::holds_alternative<std::string>(value);
    default:
      return false;  // an empty text is no default to show
  }
}

Json field_schema(const YamlField& field) {
  Json schema = forms_schema(field.forms);
  if (field.standard && field.forms.size() == 1 && holds(field.forms.front(), *field.standard)) {
    schema["default"] = scalar(*field.standard);
  }
  return schema;
}

Json rule_schema(const YamlRule& rule) {
  if (rule.kind == YamlRule::Kind::not_both) return {{"not", {{"required", rule.keys}}}};
  Json one = Json::array();
  for (const std::string& key : rule.keys) one.push_back({{"required", Json::array({key})}});
  return {{"oneOf", one}};
}

/// What all branches of a map have in common.
struct Common {
  std::vector<YamlField> fields;  ///< of any branch; `required`: in all
  std::vector<YamlRule> rules;    ///< of all

  const YamlField* find(const std::string& key) const {
    const auto found = std::find_if(fields.begin(), fields.end(), [&](const YamlField& f) { return f.key == key; });
    return found == fields.end() ? nullptr : &*found;
  }
};

Common common_of(const YamlMap& map) {
  if (!map.by) return {map.fields, map.rules};
  Common all;
  for (std::size_t b = 0; b < map.branches.size(); ++b) {
    const Common branch = common_of(map.branches[b].map);
    if (b == 0) {
      all = branch;
      continue;
    }
    for (YamlField& field : all.fields) field.required = field.required && branch.find(field.key) != nullptr;
    for (const YamlField& field : branch.fields) {
      const auto known =
          std::find_if(all.fields.begin(), all.fields.end(), [&](const YamlField& f) { return f.key == field.key; });
      if (known == all.fields.end()) {
        all.fields.push_back(field);
        all.fields.back().required = false;
        continue;
      }
      known->required = known->required && field.required;
      if (known->standard != field.standard) known->standard.reset();
      for (const Form& form : field.forms) {
        if (std::find(known->forms.begin(), known->forms.end(), form) == known->forms.end()) {
          known->forms.push_back(form);
        }
      }
    }
    std::erase_if(all.rules, [&](const YamlRule& rule) {
      return std::find(branch.rules.begin(), branch.rules.end(), rule) == branch.rules.end();
    });
  }
  if (!map.by->forms.empty()) all.fields.insert(all.fields.begin(), *map.by);
  return all;
}

/// That one of the cases holds.
Json condition(const std::string& key, const std::vector<YamlCase>& cases) {
  using Case = YamlCase::Kind;
  bool absent = false;
  bool any = false;
  Json equal = Json::array();
  Json others = Json::array();
  for (const YamlCase& one : cases) {
    if (one.kind == Case::absent) absent = true;
    if (one.kind == Case::present) any = true;
    if (one.kind == Case::equal) equal.push_back(scalar(one.value));
    if (one.kind == Case::other) others.push_back(scalar(one.value));
  }
  any = any || (!equal.empty() && !others.empty());
  const Json there = {{"required", Json::array({key})}};
  if (absent && !any && equal.empty() && others.empty()) return {{"not", there}};
  Json schema = Json::object();
  if (!any && !equal.empty()) schema["properties"][key]["enum"] = equal;
  if (!any && !others.empty()) schema["properties"][key]["not"]["enum"] = others;
  if (!absent) schema.update(there);
  return schema;
}

/// What `map` says beyond `outer`, in which it is a branch. `branched`: keys that outer branches go by.
Json branch_schema(const YamlMap& map, const Common& outer, std::vector<std::string> branched) {
  Common own = common_of(map);
  Json schema = Json::object();
  Json required = Json::array();
  for (const YamlField& field : own.fields) {
    const YamlField* known = outer.find(field.key);
    if (known == nullptr || known->forms != field.forms) schema["properties"][field.key] = field_schema(field);
    if (field.required && (known == nullptr || !known->required)) required.push_back(field.key);
  }
  for (const YamlField& field : outer.fields) {
    const bool is_branched = std::find(branched.begin(), branched.end(), field.key) != branched.end();
    if (is_branched) {
      own.fields.push_back(field);
    } else if (own.find(field.key) == nullptr) {
      schema["properties"][field.key] = false;
    }
  }
  if (!required.empty()) schema["required"] = required;
  Json all = Json::array();
  for (const YamlRule& rule : own.rules) {
    if (std::find(outer.rules.begin(), outer.rules.end(), rule) == outer.rules.end()) all.push_back(rule_schema(rule));
  }
  if (map.by) branched.push_back(map.by->key);
  for (const YamlBranch& branch : map.branches) {
    const Json then = branch_schema(branch.map, own, branched);
    if (!then.empty()) all.push_back({{"if", condition(map.by->key, branch.cases)}, {"then", then}});
  }
  if (!all.empty()) schema["allOf"] = all;
  return schema;
}

Json map_schema(const YamlMap& map) {
  Json schema = {{"type", "object"}, {"additionalProperties", false}};
  schema.update(branch_schema(map, {}, {}));
  return schema;
}

template <typename T>
Json schema_of() {
  return map_schema(*describe_yaml<T>());
}

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"device", schema_of<sim::DeviceSpec>},
      {"object", schema_of<sim::ObjectSpec>},
      {"motion", schema_of<sim::MotionSpec>},
      {"scene", schema_of<sim::SceneSpec>},
      {"job",
       [] {  // distinguished as is_draw_job_file does
         return Json{{"if", {{"required", {"draw"}}}},
                     {"then", schema_of<datasets::DrawJob>()},
                     {"else", schema_of<datasets::Job>()}};
       }},
      {"study", schema_of<StudySpec>},
      {"palpation", schema_of<PalpationSpec>},
      {"fit", schema_of<UnitFitSpec>},
      {"residual", schema_of<sim::ResidualMap>},
  };
  return all;
}

std::string text_of(const Json& schema, const std::string& title) {
  Json whole = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}};
  whole.update(schema);
  return whole.dump(1) + "\n";
}

}  // namespace

std::vector<std::string> file_kinds() {
  std::vector<std::string> names;
  for (const Kind& kind : kinds()) names.emplace_back(kind.name);
  return names;
}

std::string file_schema(const std::string& kind) {
  for (const Kind& one : kinds()) {
    if (kind == one.name) return text_of(one.schema(), "Touchstone: " + kind);
  }
  const std::vector<std::string> known = file_kinds();
  fail("there is no kind of file '{}'{}; known are {}", kind, did_you_mean(kind, known), fmt::join(known, ", "));
}

}  // namespace touchstone::lab
