#pragma once
// An object on a gel, step by step, for a control loop: a pose goes in, the wrench and what the contact does come out,
// in milliseconds; the surface is worked out, and a picture can be made, only when it is asked for
// (VirtualSensor::touch(object, session, ...)). Friction and relaxation remember all steps.

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>

#include "core/transform.h"
#include "fem/contact/press.h"
#include "fem/contact/press_body.h"
#include "fem/elements/compliance.h"
#include "fem/error/press_error.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// What a single step may do.
struct TouchSessionSettings {
  /// How far the object may go in a step that begins in contact, mm, turns included. More is taken for a mistake of the
  /// caller's (metres for millimetres, another frame's pose), unless it ends well off the gel.
  double largest_step_mm = 5.0;
  /// Steps with friction are cut into parts of this length: friction depends on the path, not on its ends alone.
  double largest_part_mm = 0.1;
};

/// How the contact moves over the object.
enum class TouchContact : std::uint8_t {
  none,             ///< nothing touches
  sticking,         ///< all that touches is carried along
  partly_slipping,  ///< a part of the contact slides: incipient slip
  sliding           ///< all that touches slides; without friction always
};
/// "none", "sticking", "partly_slipping", "sliding"
const char* name_of(TouchContact contact);

/// What a step gives. Forces act on the object, gel frame: pressing gives a positive z.
struct TouchReading {
  std::int64_t step = 0;  ///< counted from 1; 0 before the first
  double t_s = 0.0;       ///< the steps' times, summed
  RigidTransform gel_from_object;
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();  ///< N; N mm about the gel frame's origin
  TouchContact contact = TouchContact::none;
  double contact_area_mm2 = 0.0;
  double slipping_share = 0.0;  ///< of the contact's area
  /// Mean place of the contact, weighted by pressure, on the undeformed gel, mm; NaN where nothing touches.
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  fem::PressError error;        ///< what the mesh makes of it; its `displacement` is left out (0)
  bool under_resolved = false;  ///< see fem::PressState
};

/// What a state gives by itself: its step and time are 0.
TouchReading reading_of(const fem::Compliance& gel, const fem::PressState& state);

/// One object on one gel. Not for two threads at once; sessions on one gel are independent of each other.
class TouchSession {
 public:
  /// @param gel of the device; must outlive this
  /// @throws Error for a body or settings that make no sense
  TouchSession(const fem::Compliance& gel, const GelSpec& material, fem::PressBody body,
               const TouchSessionSettings& settings = {});
  ~TouchSession();
  TouchSession(TouchSession&&) noexcept;
  TouchSession& operator=(TouchSession&&) noexcept;

  /// Leads the object along the straight path to a pose within `seconds`. The first step places it there: a contact it
  /// then has was made straight from above.
  /// @throws Error, the session being as before the step, for a time that isn't finite and above 0; a pose that isn't
  /// finite or whose rotation isn't one; a step beyond TouchSessionSettings; a pose deeper than the gel; an iteration
  /// that doesn't converge
  const TouchReading& step(const RigidTransform& gel_from_object, double seconds);
  /// The same with axes led by force, or torques given. @throws Error also if they can't be had (fem::Press::step)
  const TouchReading& step(const fem::PressTarget& target);

  /// Of the last step.
  const TouchReading& reading() const;
  /// All that mechanics gives of the last step, with the surface's displacement: what VirtualSensor::touch takes.
  fem::PressState press() const;
  /// The error bars that belong to press().
  fem::PressError error(const fem::PressState& press) const;

  /// Lifts the object off and forgets all steps: friction, relaxation, time.
  void restart();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::sim
