#pragma once

#include <string>

#include "sim/plan/need.h"
#include "sim/plan/plan.h"

namespace touchstone::sim {

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
  /// closed form, or as it was measured. Where no accuracy is stated, or nothing is known, `called_for` says.
  bool add_by_need(const std::string& name, Switch forced, bool called_for, const std::string& why,
                   const std::string& cost, const std::optional<Change>& known = {}) {
    const Change* change = known ? &*known : change_of(needs_, name);
    if (!accuracy_ || change == nullptr) return add(name, forced, called_for, why, cost);
    const bool on = add(name, forced, exceeds(*change, *accuracy_),
                        fmt::format("{}; leaving it out changes {}", why, in_words(*change, *accuracy_)), cost);
    plan_.effects.back().change = *change;
    return on;
  }

 private:
  Plan& plan_;
  std::optional<Accuracy> accuracy_;
  const SceneNeeds& needs_;
};

}  // namespace touchstone::sim
