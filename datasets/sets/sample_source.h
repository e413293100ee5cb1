#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "sim/plan/plan.h"
#include "sim/press/gel_setup.h"
#include "sim/press/play_motion.h"
#include "sim/press/truth.h"
#include "sim/scene/scene.h"
#include "sim/sensor/event_stream.h"
#include "sim/sensor/virtual_camera.h"

namespace touchstone::datasets {

/// What a data set's samples come from: the simulator; in tests, something that counts or fails on purpose. Each
/// function is a pure function of its arguments and may be called from several threads at once.
struct SampleSource {
  /// What the camera delivers of a state of the gel.
  using Camera = std::function<sim::Capture(const sim::Truth&)>;

  std::function<std::shared_ptr<const fem::Compliance>(const sim::DeviceSpec&, const Progress&)> set_up_gel;
  std::function<std::vector<sim::Truth>(const sim::SceneSpec&, const sim::Plan&, const fem::Compliance&,
                                        const Progress&)>
      play_motion;
  std::function<Camera(const sim::SceneSpec&, const sim::Plan&, std::shared_ptr<const fem::Compliance>,
                       std::span<const sim::Truth> truths)>
      set_up_camera;  ///< `truths` as sim::VirtualCamera takes them
  /// For scenes whose plan has event pixels. `noise_seed` as in sim::watch_events.
  std::function<sim::EventStreamReport(const sim::SceneSpec&, const sim::Plan&, const fem::Compliance&,
                                       std::uint64_t noise_seed, const sim::EventSink&, const Progress&)>
      watch_events;
};

/// The simulator, with its set-up results kept in `cache_folder`.
SampleSource simulator(const std::filesystem::path& cache_folder);

}  // namespace touchstone::datasets
