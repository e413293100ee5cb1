#pragma once
// What a virtual camera shows over time, for programs that open it like a real one (`touchstone serve`): the frames of
// a scene, or a device that gets presses on request. Light is computed once; each time that a frame is shown it is
// exposed anew, with noise of its own.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/frame.h"
#include "core/progress.h"
#include "lab/device/camera_state.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// A scene that is shown again and again.
struct SceneFeed {
  std::string device;
  double frame_rate_Hz = 30.0;
  cv::Size size;
  std::vector<std::shared_ptr<const CameraState>> states;  ///< one a frame
  bool has_events = false;
  std::vector<Event> events;   ///< from 0 to the last frame's time
  std::int64_t period_us = 0;  ///< from one showing to the next: a frame longer than the events
};

/// Plays a scene and computes the light of its frames `first` to `last` (numbers in the scene; none: all), and its
/// events where its `outputs` have them.
/// @throws Error for a scene without frames or with other frames than these, whose light wouldn't fit into
/// `most_bytes`, and as sim::play_motion
SceneFeed feed_of_scene(const sim::SceneSpec& scene, const std::filesystem::path& cache_folder,
                        const std::optional<std::pair<int, int>>& first_last, std::int64_t most_bytes,
                        const Progress& progress = {});

/// A device's hold as a state that can be shown; the device must outlive it.
CameraState camera_state(const sim::Touch& held);

}  // namespace touchstone::lab
