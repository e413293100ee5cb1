#include "sim/plan/need.h"

#include <fmt/format.h>

#include <algorithm>

#include "sim/plan/change_units.h"

namespace touchstone::sim {

bool exceeds(const Change& change, const Accuracy& allowed) {
  return std::any_of(kChangeUnits.begin(), kChangeUnits.end(), [&](const ChangeUnit& unit) {
    return change.*unit.changed && *(change.*unit.changed) > allowed.*unit.allowed;
  });
}

Accuracy parts_of(const Accuracy& accuracy, double part) {
  Accuracy parts;
  for (const ChangeUnit& unit : kChangeUnits) parts.*unit.allowed = part * (accuracy.*unit.allowed);
  return parts;
}

std::string in_words(const Change& change, const Accuracy& allowed) {
  std::string words;
  for (const ChangeUnit& unit : kChangeUnits) {
    if (!(change.*unit.changed)) continue;
    if (!words.empty()) words += ", ";
    words += fmt::format(fmt::runtime(unit.words), *(change.*unit.changed), allowed.*unit.allowed);
  }
  return words.empty() ? "nothing" : words;
}

const Change* change_of(const SceneNeeds& needs, std::string_view effect) {
  const auto found =
      std::find_if(needs.begin(), needs.end(), [&](const EffectNeed& one) { return one.effect == effect; });
  return found == needs.end() || !found->change ? nullptr : &*found->change;
}

}  // namespace touchstone::sim
