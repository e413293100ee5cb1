#pragma once

#include <string>

#include "sim/plan/plan.h"

namespace touchstone::sim {

/// Writes a plan's rows for people.
class PlanTable {
 public:
  explicit PlanTable(Plan& plan) : plan_(plan) {}

  /// @returns `on`
  bool add(const std::string& name, bool on, const std::string& why, const std::string& cost) {
    plan_.effects.push_back({name, on, why, on ? cost : "nothing"});
    return on;
  }

  /// The scene's switch counts more than what is `called_for`. @returns whether the effect is on
  bool add(const std::string& name, Switch forced, bool called_for, const std::string& why, const std::string& cost) {
    if (forced == Switch::automatic) return add(name, called_for, why, cost);
    const bool on = forced == Switch::on;
    return add(name, on, fmt::format("the scene switches it {}; by itself: {}", on ? "on" : "off", why), cost);
  }

 private:
  Plan& plan_;
};

}  // namespace touchstone::sim
