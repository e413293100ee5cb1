#pragma once
// A press whose object vibrates fast enough for the gel's inertia to count.

#include <memory>

#include "fem/contact/press.h"
#include "fem/vibration/vibration.h"
#include "sim/scene/motion.h"

namespace touchstone::sim {

/// Adds the steady answer of the gel to a body that sticks where it touches (fem/vibration/vibration.h) to the press of
/// the mean motion: linear in the amplitude, without what the vibration does to contact and slip.
class ShakenPress {
 public:
  /// The gel and its vibration must outlive this. `friction` is the mean press's.
  ShakenPress(const fem::Compliance& gel, const fem::GelVibration& vibration, fem::PronySeries relaxation,
              double friction);
  ~ShakenPress();

  /// The state at `seconds` since the vibration's start: pose, force, torque, tractions and displacements. What tells
  /// of the contact laws (residuals, states of nodes, area) stays the mean press's.
  /// @throws Error if the force's amplitude would lift the body off the gel or make it slide, if the frequency is too
  /// high for the modes or too near a resonance for them (a truncation over 5 % of the force), or at a resonance that
  /// nothing damps (StuckPatch::answer)
  fem::PressState at(const fem::PressState& mean, const VibrationSpec& vibration, double seconds);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone::sim
