#include "python/src/sensor.h"

#include <algorithm>

#include "sim/press/touch_doubts.h"

namespace touchstone::python {
sim::TouchObject Sensor::object(const SharedObject& object) const {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = std::find_if(seen_.begin(), seen_.end(), [&](const auto& one) { return one.first == object; });
    if (known != seen_.end()) return known->second;
  }
  sim::TouchObject made = sensor_.object(*object);
  const std::lock_guard<std::mutex> lock(mutex_);
  seen_.emplace_front(object, made);
  if (seen_.size() > kObjectsKept) seen_.pop_back();
  return made;
}

Touch Sensor::finished(const sim::TouchObject& by, sim::Touch touch, const sim::TouchReading& reading,
                       const sim::TouchOptions& options) const {
  Touch finished;
  finished.reading = reading;
  const auto* const shape = by.spec().elastic ? nullptr : &by.shape();
  finished.doubts = sim::touch_doubts(device().gel, gel(), {&shape, 1}, touch.press);
  if (options.picture && options.truth) finished.ideal = sensor_.ideal(by, touch);
  if (options.picture) finished.light_error = sensor_.light().error;
  if (!touch.contact.empty()) touch.contact.setTo(1, touch.contact != 0);
  finished.of = std::move(touch);
  return finished;
}

Touch Sensor::press(const SharedObject& object_of, const sim::PressSpec& press,
                    const sim::TouchOptions& options) const {
  const sim::TouchObject by = object(object_of);
  sim::Touch touch = sensor_.press(by, press, options);
  const sim::TouchReading reading = sim::reading_of(gel(), touch.press);
  return finished(by, std::move(touch), reading, options);
}

Touch Sensor::touch(const SharedObject& object_of, const sim::TouchSession& session,
                    const sim::TouchOptions& options) const {
  const fem::PressState press = session.press();
  const sim::TouchObject by = object(object_of);
  sim::Touch touch;
  if (options.picture) {
    touch = sensor_.capture(by, press, options.noise_seed, options.frame, options.truth);
  }
  sensor_.add_truth(press, session.error(press), touch);
  return finished(by, std::move(touch), session.reading(), options);
}

}  // namespace touchstone::python
