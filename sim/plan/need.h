#pragma once
// What an effect changes in a scene, in the units of who looks at it, beside what its owner allows to leave out.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/accuracy.h"

namespace touchstone::sim {

/// What a scene's pictures, forces and places would be off without an effect. What isn't there isn't touched by it.
struct Change {
  std::optional<double> force_percent;  ///< the largest over the states looked at, of the force's size in each
  std::optional<double> pixel_noise;    ///< root mean square over pixels that see the contact and what is about it
  std::optional<double> marker_px;      ///< the largest: of beads, markers, and the surface where there are neither
  std::optional<double> height_um;      ///< the largest, of the gel's surface
  /// Of the change of log light from the untouched gel to the states looked at, which is what events are: root mean
  /// squares over the same pixels.
  std::optional<double> event_percent;

  bool operator==(const Change&) const = default;
};

/// Whether it is more than may be left out, in any unit.
bool exceeds(const Change& change, const Accuracy& allowed);

/// So much of it in each unit.
Accuracy parts_of(const Accuracy& accuracy, double part);

/// As "a force by 3.2 % (allowed 1), pixels by 5.3 of their noise (allowed 1)"; "nothing" if it changes nothing.
std::string in_words(const Change& change, const Accuracy& allowed);

/// What one effect changes, as measured (sim/need/scene_needs.h).
struct EffectNeed {
  std::string effect;            ///< as in Plan::effects
  std::optional<Change> change;  ///< nothing: it couldn't be measured
  std::string note;              ///< why not, for people
};

/// The name of what isn't an effect but changes forces as one: a finer mesh than the device's.
inline constexpr const char* kFinerMesh = "finer mesh";

/// The same of pixels that are traced: more paths than light_limits allows, or until less noise.
inline constexpr const char* kMorePaths = "more paths";

/// Of a scene.
using SceneNeeds = std::vector<EffectNeed>;

/// Null if the effect isn't among them or couldn't be measured.
const Change* change_of(const SceneNeeds& needs, std::string_view effect);

}  // namespace touchstone::sim
