#pragma once
// The grasps of lab/dvs/dvs_grasps.h as the event camera sees them: events counted, with forces and truth on one clock.

#include <cstdint>
#include <span>
#include <vector>

#include "core/progress.h"
#include "lab/dvs/dvs_grasps.h"
#include "render/events/event_pixels.h"
#include "sensors/events/event_windows.h"
#include "sim/sensor/event_stream.h"
#include "sim/sensor/membrane_camera.h"

namespace touchstone::lab {

/// The camera watches so long before the servo moves: what is at rest is judged by 140 ms of it (grasp_phases.h).
inline constexpr double kDvsWatched_s = 0.2;

/// What one kind of event pixels recorded of a grasp.
struct DvsEvents {
  std::vector<sensors::EventCounts> counts;  ///< per millisecond, from the recording's start
  std::int64_t events = 0;                   ///< all, also those of a last millisecond that isn't whole
};

/// One grasp as recorded, with its truth.
struct DvsRecording {
  DvsGraspParameters parameters;
  std::vector<DvsEvents> by_pixels;         ///< one of each kind of event pixels that was asked for
  std::vector<sim::ForceReading> readings;  ///< from the first touch on; seconds on the recording's clock
  double touch_s = 0.0;                     ///< truth: the first touch
  double release_s = 0.0;                   ///< truth: the servo is commanded to open
  double apart_s = 0.0;                     ///< truth: the last moment of contact
  std::int64_t pictures = 0;                ///< made of the membrane
  std::int64_t steps = 0;                   ///< of each event pixel, from one light to the next
};

/// Which event pixels are shown the grasp, and how finely.
struct DvsRecordSettings {
  std::vector<render::EventPixelSettings> pixels;  ///< kinds, at least one; the device's own first
  std::uint64_t unit_seed = 1;                     ///< thresholds: one sensor for all grasps
  /// How far the light of any pixel between two pictures may be off (DvsTravelLight), and how small a change of it may
  /// wait; in parts of the smallest mean threshold of all kinds, at most 0.5.
  double tolerance = 0.05;
  sim::ReferenceForceSensorSettings force_sensor;
};

/// The settings with the device's own event pixels alone. @throws Error if it has none
DvsRecordSettings own_pixels(const sim::DeviceSpec& device);

/// Plays a grasp and watches it, from the time 0 to the last moment that is played. `sink` is given the events of the
/// first kind of pixels. The same for any number of threads. @throws Error as DvsGraspSetup::play and EventPixels, for
/// settings that make no sense
DvsRecording record_dvs_grasp(const DvsGraspSetup& setup, const sim::MembraneCamera& camera,
                              const DvsGraspParameters& parameters, const DvsRecordSettings& settings,
                              const sim::EventSink& sink = {});

/// Grasps side by side, in the order given. @throws Error as record_dvs_grasp
std::vector<DvsRecording> record_dvs_grasps(const DvsGraspSetup& setup, const sim::MembraneCamera& camera,
                                            std::span<const DvsGraspParameters> grasps,
                                            const DvsRecordSettings& settings, const Progress& progress = {});

/// Counts of whole windows of `length_ms` each, the first one from `from_ms` on.
/// @throws Error if from_ms is negative or the length isn't above 0
std::vector<sensors::EventCounts> windows_of(const DvsEvents& events, int from_ms, int length_ms);

}  // namespace touchstone::lab
