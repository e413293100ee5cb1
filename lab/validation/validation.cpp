#include "lab/validation/validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "core/nearest_name.h"

namespace touchstone::lab {
namespace {

using nlohmann::ordered_json;

ordered_json number_or_null(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? ordered_json(*value) : ordered_json(nullptr);
}

std::string number_text(const std::optional<double>& value) {
  return value ? fmt::format("{:.4g}", *value) : "-";
}

}  // namespace

std::string name_of(Better better) {
  switch (better) {
    case Better::lower:
      return "lower";
    case Better::higher:
      return "higher";
    case Better::near:
      return "near";
  }
  TS_ASSERT(false);
  return {};
}

void deny(ValidationRow& row, const std::string& finding) {
  row.holds = false;
  row.denies = finding;
}

std::string words_of(const ValidationRow& row) {
  if (row.denies.empty()) return row.title;
  return fmt::format("{} (doesn't hold: denies the finding that {})", row.title, row.denies);
}

std::vector<ValidationRow> validate(const std::vector<std::string>& names, const std::vector<ValidationGroup>& known,
                                    const ValidateOptions& options) {
  std::vector<std::string> allowed = {"all"};
  for (const ValidationGroup& group : known) {
    const std::string whole = group.name.substr(0, group.name.find('.'));
    if (whole != group.name && allowed.back() != whole && !allowed.back().starts_with(whole + '.')) {
      allowed.push_back(whole);
    }
    allowed.push_back(group.name);
  }
  std::set<std::string> wanted;
  for (const std::string& name : names) {
    if (std::find(allowed.begin(), allowed.end(), name) == allowed.end()) {
      fail("'{}' is nothing that can be validated{}; allowed is one of: {}", name, did_you_mean(name, allowed),
           fmt::join(allowed, ", "));
    }
    wanted.insert(name);
  }
  std::vector<ValidationRow> rows;
  std::set<std::string> ids;
  for (const ValidationGroup& group : known) {
    const std::string whole = group.name.substr(0, group.name.find('.'));
    if (!wanted.contains("all") && !wanted.contains(group.name) && !wanted.contains(whole)) continue;
    for (ValidationRow& row : group.run(options)) {
      TS_ASSERT(ids.insert(row.id).second);
      TS_ASSERT(row.denies.empty() || !row.holds);
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::string to_json(const std::vector<ValidationRow>& rows) {
  ordered_json list = ordered_json::array();
  for (const ValidationRow& row : rows) {
    ordered_json record = {{"id", row.id},
                           {"title", words_of(row)},
                           {"unit", row.unit},
                           {"published", number_or_null(row.published)},
                           {"reference", number_or_null(row.reference)},
                           {"ours", number_or_null(row.ours)},
                           {"ci95", nullptr},
                           {"better", name_of(row.better)},
                           {"holds", row.holds},
                           {"quick", row.quick},
                           {"seconds", row.seconds}};
    if (row.ci95) {
      record["ci95"] = ordered_json::array({number_or_null(row.ci95->first), number_or_null(row.ci95->second)});
    }
    list.push_back(std::move(record));
  }
  return list.dump(1) + "\n";
}

std::string to_table(const std::vector<ValidationRow>& rows) {
  std::size_t widest = 3;
  for (const ValidationRow& row : rows) widest = std::max(widest, row.id.size());
  std::string table = fmt::format("{:<{}}  {:>11} {:>11}  {:<6} {:<6} {:<5} {}\n", "row", widest, "ours", "against",
                                  "unit", "better", "holds", "what");
  for (const ValidationRow& row : rows) {
    const std::optional<double>& against = row.published ? row.published : row.reference;
    table += fmt::format("{:<{}}  {:>11} {:>11}  {:<6} {:<6} {:<5} {}\n", row.id, widest, number_text(row.ours),
                         number_text(against), row.unit, name_of(row.better), row.holds ? "yes" : "NO", words_of(row));
  }
  return table;
}

}  // namespace touchstone::lab
