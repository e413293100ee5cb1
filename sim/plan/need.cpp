#include "sim/plan/need.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace touchstone::sim {
namespace {

/// One unit of a change beside what is allowed.
struct Amount {
  const std::optional<double>& changed;
  double allowed;
  const char* words;  ///< of the amount and what is allowed
};

std::array<Amount, 4> amounts_of(const Change& change, const Accuracy& allowed) {
  return {{{change.force_percent, allowed.force_percent, "a force by {:.2g} % (allowed {:.3g})"},
           {change.pixel_noise, allowed.pixel_noise, "pixels by {:.2g} of their noise (allowed {:.3g})"},
           {change.marker_px, allowed.marker_px, "places in the picture by {:.2g} pixels (allowed {:.3g})"},
           {change.height_um, allowed.height_um, "heights by {:.2g} um (allowed {:.3g})"}}};
}

}  // namespace

bool exceeds(const Change& change, const Accuracy& allowed) {
  const auto amounts = amounts_of(change, allowed);
  return std::any_of(amounts.begin(), amounts.end(),
                     [](const Amount& one) { return one.changed && *one.changed > one.allowed; });
}

std::string in_words(const Change& change, const Accuracy& allowed) {
  std::string words;
  for (const Amount& one : amounts_of(change, allowed)) {
    if (!one.changed) continue;
    if (!words.empty()) words += ", ";
    words += fmt::format(fmt::runtime(one.words), *one.changed, one.allowed);
  }
  return words.empty() ? "nothing" : words;
}

const Change* change_of(const SceneNeeds& needs, std::string_view effect) {
  const auto found =
      std::find_if(needs.begin(), needs.end(), [&](const EffectNeed& one) { return one.effect == effect; });
  return found == needs.end() || !found->change ? nullptr : &*found->change;
}

}  // namespace touchstone::sim
