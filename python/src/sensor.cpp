#include "python/src/sensor.h"

#include <algorithm>

#include "core/error.h"

namespace touchstone::python {
namespace {

constexpr std::size_t kObjectsKept = 8;

}  // namespace

Sensor::Sensor(sim::DeviceSpec device, std::filesystem::path cache, const sim::TouchRigSettings& settings,
               const Progress& progress)
    : device_(std::move(device)),
      cache_(std::move(cache)),
      settings_(settings),
      gel_(sim::set_up_gel(device_, cache_, progress)) {}

const sim::TouchRig& Sensor::rig() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!rig_) rig_ = std::make_unique<const sim::TouchRig>(device_, cache_, settings_);
  return *rig_;
}

sim::TouchSession Sensor::session(const SharedObject& object, const sim::TouchSessionSettings& settings) const {
  if (object->elastic) {
    fail("object {}: is elastic, and a sensor takes rigid ones; data sets of elastic objects are made by jobs",
         object->name);
  }
  fem::PressBody body;
  body.shape = sim::coarse_contact_shape(*object, device_.mesh.fine_mm);
  body.friction = object->friction;
  return {*gel_, device_.gel, std::move(body), settings};
}

sim::TouchObject Sensor::seen(const SharedObject& object) const {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = std::find_if(seen_.begin(), seen_.end(), [&](const auto& one) { return one.first == object; });
    if (known != seen_.end()) return known->second;
  }
  sim::TouchObject made = rig().object(*object);
  const std::lock_guard<std::mutex> lock(mutex_);
  seen_.emplace_front(object, made);
  if (seen_.size() > kObjectsKept) seen_.pop_back();
  return made;
}

Touch Sensor::touch(const SharedObject& object, const sim::TouchSession& session, const Look& look) const {
  Touch touch;
  touch.reading = session.reading();
  touch.press = session.press();
  touch.error = session.error(touch.press);
  if (!look.picture) return touch;
  touch.pictures = rig().look(seen(object), touch.press, look.noise_seed, look.frame, look.truth);
  if (!touch.pictures.contact.empty()) touch.pictures.contact.setTo(1, touch.pictures.contact != 0);
  if (look.truth) touch.ideal = rig().ideal(touch.pictures.light);
  touch.light_error = rig().light().error;
  return touch;
}

}  // namespace touchstone::python
