#pragma once
// From a scene to the events of its camera.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "fem/vibration/vibration.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// Takes events in the order of (t, y, x, OFF before ON), in portions as they come.
using EventSink = std::function<void(std::span<const Event>)>;

/// What a stream took, and how dense it was.
struct EventStreamReport {
  std::int64_t events = 0;
  std::int64_t pictures = 0;
  std::int64_t pixels_traced = 0;
  std::int64_t paths_traced = 0;
  std::int64_t keys = 0;          ///< pictures drawn in full, where the others are moved from them; else 0
  double worst_key_rms = 0.0;     ///< LightBetweenReport::worst_rms
  std::int64_t coarse_steps = 0;  ///< how often a pixel passed more than the smallest threshold between two pictures
};

/// Plays a scene's motion and watches it by the event pixels of its device, from the first frame's time, 0, to the last
/// one's. Nothing is kept: memory doesn't grow with the sequence.
///
/// Pictures (sim/sensor/light_sequence.h) are made at the states that are played (plan.states_a_frame) and, between two
/// of them, as densely as no pixel changes by light.event_step of the smallest threshold from one to the next; but no
/// denser than a motion of 0.02 pixels, which the paths of a pixel can't resolve, or a microsecond. Between pictures
/// the logarithm runs straight.
///
/// Before a coated gel most pictures are moved from a few that are drawn in full (sim/sensor/light_between.h), where
/// that can be had. There is then one for each state that is played, and as many between two as nothing moves by
/// LightBetween::kMovedStep_px from one to the next. A reach of 0 draws all of them in full.
///
/// Thresholds belong to the unit, the scene's seed; `noise_seed` is of the noise in time. The same for any number of
/// threads. `vibration` and `elastic` as in play_motion.
/// @throws Error as play_motion
EventStreamReport watch_events(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                               std::uint64_t noise_seed, const EventSink& sink, const Progress& progress = {},
                               const fem::GelVibration* vibration = nullptr,
                               const std::vector<std::shared_ptr<const fem::Compliance>>& elastic = {});

}  // namespace touchstone::sim
