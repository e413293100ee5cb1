#include "datasets/inspection/estimate_quantities.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

namespace touchstone::datasets {
namespace {

constexpr std::array<const char*, 6> kKeys = {"sequence", "frame", "file", "t_us", "marker", "bead"};

struct Unit {
  const char *suffix, *printed, *plain;
};
constexpr std::array<Unit, 13> kUnits = {{{"Nmm", "N mm", "N mm"},
                                          {"N", "N", "N"},
                                          {"mm2", "mm\xC2\xB2", "mm^2"},
                                          {"mm3", "mm\xC2\xB3", "mm^3"},
                                          {"mm", "mm", "mm"},
                                          {"um", "\xC2\xB5m", "um"},
                                          {"us", "\xC2\xB5s", "us"},
                                          {"px", "px", "px"},
                                          {"deg", "degrees", "deg"},
                                          {"percent", "%", "%"},
                                          {"MPa", "MPa", "MPa"},
                                          {"Hz", "Hz", "Hz"},
                                          {"s", "s", "s"}}};
constexpr std::array<const char*, 7> kAxes = {"x", "y", "z", "u", "v", "dx", "dy"};
constexpr std::size_t kMostStates = 12, kLongestState = 24;

/// A column's name in its parts: "force", "x", "N" of `force_x_N`.
struct NameParts {
  std::string stem, axis, unit;
};

/// Takes `_word`, or the whole text if it is that word, from the end.
bool take_word(std::string& text, std::string_view word) {
  if (text == word) {
    text.clear();
    return true;
  }
  if (text.size() <= word.size() + 1 || !text.ends_with(word) || text[text.size() - word.size() - 1] != '_') {
    return false;
  }
  text.resize(text.size() - word.size() - 1);
  return true;
}

/// Takes the unit from a name's end; null if there is none.
const Unit* take_unit(std::string& name) {
  const auto found = std::ranges::find_if(kUnits, [&](const Unit& unit) { return take_word(name, unit.suffix); });
  return found == kUnits.end() ? nullptr : &*found;
}

NameParts name_parts(const std::string& name) {
  NameParts parts;
  parts.stem = name;
  if (const Unit* const unit = take_unit(parts.stem)) parts.unit = unit->printed;
  for (const char* const axis : kAxes) {
    if (take_word(parts.stem, axis)) {
      parts.axis = axis;
      break;
    }
  }
  return parts;
}

bool is_flag(const EstimateColumn& column) {
  return std::ranges::all_of(column.numbers,
                             [](double value) { return std::isnan(value) || value == 0.0 || value == 1.0; });
}

/// The true values of a column, by its name.
const EstimateColumn* truth_of(const EstimateTable& table, const std::string& name) {
  if (const EstimateColumn* const truth = table.column("true_" + name)) return truth;
  constexpr std::string_view kForce = "force_";
  return name.starts_with(kForce) ? table.column("true_" + name.substr(kForce.size())) : nullptr;
}

}  // namespace

std::string unit_of_column(std::string name) {
  const Unit* const unit = take_unit(name);
  return unit == nullptr ? "1" : unit->plain;
}

EstimateParts parts_of(const EstimateTable& table) {
  EstimateParts parts;
  const bool many_lines = table.column("marker") != nullptr || table.column("bead") != nullptr;
  for (const EstimateColumn& column : table.columns) {
    if (std::ranges::find(kKeys, column.name) != kKeys.end() || column.name.starts_with("true_") ||
        column.name.starts_with("sigma_")) {
      continue;
    }
    if (!column.is_numeric()) {
      const bool short_words =
          column.distinct.size() <= kMostStates &&
          std::ranges::all_of(column.distinct, [](const std::string& word) { return word.size() <= kLongestState; });
      if (!column.distinct.empty()) (short_words ? parts.states : parts.remarks).push_back(&column);
      continue;
    }
    const NameParts name = name_parts(column.name);
    if (name.unit.empty() && is_flag(column)) {
      parts.flags.push_back(&column);
      continue;
    }
    // Where a marker is, beside how far it has moved.
    if (many_lines && name.stem.empty() && table.column("dx_px") != nullptr && (name.axis == "x" || name.axis == "y")) {
      continue;
    }
    std::string title = name.stem.empty() ? (name.axis.starts_with('d') ? "displacement" : "position") : name.stem;
    std::ranges::replace(title, '_', ' ');
    auto known = std::ranges::find_if(parts.quantities, [&](const EstimatedQuantity& other) {
      return other.name == title && other.unit == name.unit && !name.axis.empty();
    });
    if (known == parts.quantities.end()) {
      parts.quantities.push_back({title, name.unit, {}});
      known = std::prev(parts.quantities.end());
    }
    known->components.push_back({name.axis.empty() ? title : name.axis, &column, truth_of(table, column.name),
                                 table.column("sigma_" + column.name)});
  }
  return parts;
}

}  // namespace touchstone::datasets
