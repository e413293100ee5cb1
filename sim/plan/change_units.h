#pragma once
// The units of a change: the one list that whoever goes through them uses.

#include <array>
#include <optional>

#include "sim/plan/need.h"

namespace touchstone::sim {

/// One unit: its key in files, its name in tables, a sentence's part of the amount and what is allowed, and where both
/// are.
struct ChangeUnit {
  const char* key;
  const char* name;
  const char* words;
  std::optional<double> Change::*changed;
  double Accuracy::*allowed;
};

/// All of them.
inline constexpr std::array<ChangeUnit, 5> kChangeUnits = {
    {{"force_percent", "force, %", "a force by {:.2g} % (allowed {:.3g})", &Change::force_percent,
      &Accuracy::force_percent},
     {"pixel_noise", "pixels, noise", "pixels by {:.2g} of their noise (allowed {:.3g})", &Change::pixel_noise,
      &Accuracy::pixel_noise},
     {"marker_px", "places, px", "places in the picture by {:.2g} pixels (allowed {:.3g})", &Change::marker_px,
      &Accuracy::marker_px},
     {"height_um", "heights, um", "heights by {:.2g} um (allowed {:.3g})", &Change::height_um, &Accuracy::height_um},
     {"event_percent", "events, %", "events by {:.2g} % (allowed {:.3g})", &Change::event_percent,
      &Accuracy::event_percent}}};

}  // namespace touchstone::sim
