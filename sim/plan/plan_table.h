#pragma once

#include <string>

#include "sim/plan/need.h"
#include "sim/plan/plan.h"

namespace touchstone::sim {

/// Of what is allowed: an effect that was measured to change more is taken. A measurement by few pixels on a coarse
/// mesh may be off by a third: of nine effects one was 0.86 of what is allowed, and 1.07 closely.
inline constexpr double kTakenFrom = 0.75;

/// Writes a plan's rows for people.
class PlanTable {
 public:
  /// `accuracy` as the scene or its device states it, and what effects were measured to change.
  PlanTable(Plan& plan, std::optional<Accuracy> accuracy, const SceneNeeds& needs)
      : plan_(plan), accuracy_(accuracy), needs_(needs) {}

  const std::optional<Accuracy>& accuracy() const { return accuracy_; }

  /// @returns `on`
  bool add(const std::string& name, bool on, const std::string& why, const std::string& cost) {
    plan_.effects.push_back({name, on, why, on ? cost : "nothing", {}});
    return on;
  }

  /// The scene's switch counts more than what is `called_for`. @returns whether the effect is on
  bool add(const std::string& name, Switch forced, bool called_for, const std::string& why, const std::string& cost) {
    if (forced == Switch::automatic) return add(name, called_for, why, cost);
    const bool on = forced == Switch::on;
    return add(name, on, fmt::format("the scene switches it {}; by itself: {}", on ? "on" : "off", why), cost);
  }

  /// The same of an effect that is called for where it changes more than the accuracy lets out: by `known`, from a
  /// closed form, or, from kTakenFrom of that on, as it was measured. Where no accuracy is stated, or nothing is known,
  /// `called_for` says.
  bool add_by_need(const std::string& name, Switch forced, bool called_for, const std::string& why,
                   const std::string& cost, const std::optional<Change>& known = {}) {
    const Change* change = known ? &*known : change_of(needs_, name);
    if (!accuracy_ || change == nullptr) return add(name, forced, called_for, why, cost);
    const bool much = exceeds(*change, known ? *accuracy_ : parts_of(*accuracy_, kTakenFrom));
    const char* close = much && !exceeds(*change, *accuracy_) ? ", and measured so near to that it is taken" : "";
    const bool on =
        add(name, forced, much,
            fmt::format("{}; leaving it out changes {}{}", why, in_words(*change, *accuracy_), close), cost);
    plan_.effects.back().change = *change;
    return on;
  }

 private:
  Plan& plan_;
  std::optional<Accuracy> accuracy_;
  const SceneNeeds& needs_;
};

}  // namespace touchstone::sim
