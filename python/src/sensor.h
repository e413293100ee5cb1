#pragma once
// What the classes Sensor, Object, Touch and Session of Python hold. No function here needs the GIL, and all but
// Session's may be called from any thread.

#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "sim/press/touch_session.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::python {

/// A touched object; sensors know it by its address.
using SharedObject = std::shared_ptr<const sim::ObjectSpec>;

/// As many of the objects named last are kept, each with what a sensor made of it.
inline constexpr std::size_t kObjectsKept = 8;

/// One touch: what the sensor delivers and what is true of it.
struct Touch {
  sim::Touch of;              ///< contact: 0 and 1
  sim::TouchReading reading;  ///< what its contact does
  cv::Mat ideal;              ///< sim::VirtualSensor::ideal; empty without truth
  std::optional<render::DirectError> light_error;
  std::vector<std::string> doubts;  ///< sim::touch_doubts
};

/// A device with the objects that touched it last.
class Sensor {
 public:
  Sensor(sim::DeviceSpec device, const std::filesystem::path& cache, const sim::VirtualSensorSettings& settings,
         const Progress& progress)
      : sensor_(std::move(device), cache, settings, progress) {}

  const sim::VirtualSensor& virtual_sensor() const { return sensor_; }
  const sim::DeviceSpec& device() const { return sensor_.device(); }
  const fem::Compliance& gel() const { return sensor_.gel(); }

  sim::TouchObject object(const SharedObject& object) const;
  Touch press(const SharedObject& object, const sim::PressSpec& press, const sim::TouchOptions& options) const;
  Touch touch(const SharedObject& object, const sim::TouchSession& session, const sim::TouchOptions& options) const;

 private:
  Touch finished(const sim::TouchObject& by, sim::Touch touch, const sim::TouchReading& reading,
                 const sim::TouchOptions& options) const;

  sim::VirtualSensor sensor_;
  mutable std::mutex mutex_;
  mutable std::deque<std::pair<SharedObject, sim::TouchObject>> seen_;  // the last few
};

}  // namespace touchstone::python
