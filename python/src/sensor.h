#pragma once
// What the classes Sensor, Object, Touch and Session of Python hold. No function here needs the GIL, and all but
// Session's may be called from any thread.

#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "core/progress.h"
#include "sim/press/touch_session.h"
#include "sim/sensor/touch_rig.h"

namespace touchstone::python {

/// A touched object; sensors know it by its address.
using SharedObject = std::shared_ptr<const sim::ObjectSpec>;

/// One touch: what mechanics tells, and the pictures where they were asked for.
struct Touch {
  sim::TouchReading reading;
  fem::PressState press;
  fem::PressError error;
  sim::Touch pictures;  ///< contact: 0 and 1; all empty without a picture
  cv::Mat ideal;        ///< sim::TouchRig::ideal; empty without truth
  std::optional<render::DirectError> light_error;
};

/// What a touch's picture is made with.
struct Look {
  bool picture = true;
  bool truth = true;
  std::uint64_t noise_seed = 0;
  int frame = 0;
};

/// A device. Its gel is set up at once, its light with the first picture.
class Sensor {
 public:
  Sensor(sim::DeviceSpec device, std::filesystem::path cache, const sim::TouchRigSettings& settings,
         const Progress& progress);

  const sim::DeviceSpec& device() const { return device_; }
  const fem::Compliance& gel() const { return *gel_; }
  const sim::TouchRig& rig() const;

  /// @throws Error for an elastic object
  sim::TouchSession session(const SharedObject& object, const sim::TouchSessionSettings& settings) const;
  Touch touch(const SharedObject& object, const sim::TouchSession& session, const Look& look) const;

 private:
  sim::TouchObject seen(const SharedObject& object) const;

  sim::DeviceSpec device_;
  std::filesystem::path cache_;
  sim::TouchRigSettings settings_;
  std::shared_ptr<const fem::Compliance> gel_;
  mutable std::mutex mutex_;
  mutable std::unique_ptr<const sim::TouchRig> rig_;
  mutable std::deque<std::pair<SharedObject, sim::TouchObject>> seen_;  // the last few
};

}  // namespace touchstone::python
