#pragma once
// What a virtual camera shows over time, for programs that open it like a real one (`touchstone serve`): the frames of
// a scene, or a device that gets presses on request. Light is computed once; each time that a frame is shown it is
// exposed anew, with noise of its own.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/frame.h"
#include "core/progress.h"
#include "core/transform.h"
#include "sim/scene/scene.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// One state of what is shown. Forces are on the (first) object, gel frame.
struct CameraState {
  std::string what;       ///< in words
  int frame = 0;          ///< of the scene; 0 of a device
  std::int64_t t_us = 0;  ///< in the scene's time
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_error_N = Eigen::Vector3d::Zero();  ///< one standard error, from the mesh
  Eigen::Vector3d torque_Nmm = Eigen::Vector3d::Zero();
  std::optional<RigidTransform> gel_from_object;  ///< none of an untouched device
  double contact_area_mm2 = 0.0;
  std::function<cv::Mat(std::uint64_t noise_seed)> expose;
};

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

/// One line of JSON: what, scene_frame, t_us, force_N, force_error_N, torque_Nmm, gel_from_object (3 rows of 4, or
/// null), contact_area_mm2; `more` (JSON members, "\"a\": 1, ") stands before them.
std::string to_json(const CameraState& state, const std::string& more = "");

}  // namespace touchstone::lab
