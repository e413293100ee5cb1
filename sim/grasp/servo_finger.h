#pragma once
// A gripper's dynamic finger on a hobby servo: closes on a piece in the servo's steps, holds, opens ([Naeini2020, sec.
// III.B, V.A]: a Dynamixel AX-12A led by an Arduino).
//
// The finger is a mass on the servo's spring. Along its own normal, s being its travel beyond the touch:
//   m s'' = k (x - s) + c (x' - s') - F(s) - tau F'(s) s' + shake
// x is the servo's horn, which follows the commanded steps with a lag; k what the servo's compliance slope makes of its
// torque at the lever; F the force that the gripped face takes (sim/grasp/gripped_face.h), tau the silicone's loss.
// Contact doesn't pull. Gears' play and friction, and the piece's own mass, are left out.

#include <cstdint>
#include <vector>

#include "sim/grasp/gripped_face.h"

namespace touchstone::sim {

/// The servo, its lever and the finger on it.
struct ServoFingerSettings {
  // Public figures of the AX-12A (Robotis' e-manual).
  double step_deg = 300.0 / 1024;  ///< "Resolution 0.29 deg": 10 bits over 300 degrees
  double stall_torque_Nm = 1.5;    ///< at 12 V
  double slope_steps = 32.0;       ///< compliance slope, its default: full torque at that many steps from the goal
  // Not in the paper: chosen.
  double lever_mm = 70.0;            ///< from the horn's axis to the piece
  double lag_s = 0.010;              ///< of the horn behind a step; the servo's loop has 10 to 20 ms
  double ring_Hz = 25.0;             ///< of the free finger on the servo's spring: some 75 g
  double damping = 0.10;             ///< of it, of critical
  double loss_s = 0.5e-3;            ///< tau: at 50 Hz a loss tangent of 0.16; soft silicones have 0.1 to 0.2
  double shake_um = 3.0;             ///< RMS motion of the free finger by what shakes its mount
  double largest_closing_mm = 30.0;  ///< beyond the start: the servo is commanded no further
  double time_step_s = 5e-5;
};

/// What differs from grasp to grasp of a piece.
struct FingerMotion {
  double clearance_mm = 1.0;    ///< between piece and membrane at the start, along the travel
  double target_force_N = 2.0;  ///< of the finger, when it holds: met as nearly as the servo's steps allow
  double closing_mm_s = 14.0;
  double opening_mm_s = 40.0;
  double hold_s = 0.7;    ///< from the last closing step (sec. V.A)
  double rest_s = 0.05;   ///< before the first step
  double apart_s = 0.36;  ///< after the first opening step: 144 windows of 7 ms from the touch on (fig. 8)
  std::uint64_t shake_seed = 1;
};

/// What the servo was commanded to do last.
enum class FingerPhase { resting, closing, holding, opening };

/// The finger at one moment.
struct FingerMoment {
  double seconds = 0.0;
  double travel_mm = 0.0;  ///< beyond the touch; below 0: apart
  double speed_mm_s = 0.0;
  double acceleration_mm_s2 = 0.0;
  double force_N = 0.0;                      ///< on the piece, along the finger's normal, with the silicone's loss
  FingerPhase phase = FingerPhase::resting;  ///< what the servo has been commanded
};

/// One grasp, from before the touch until the finger is off the piece.
struct FingerRun {
  std::vector<FingerMoment> moments;  ///< evenly in time, from 0 on
  double static_force_N = 0.0;        ///< at rest on the last closing step
  double first_touch_s = 0.0;
  double release_s = 0.0;  ///< when the servo is commanded to open
  double apart_s = 0.0;    ///< the last moment of contact
};

/// N/mm, at the piece.
double servo_stiffness(const ServoFingerSettings& settings);

/// Plays a grasp. Moments every `interval_s`, a whole multiple of the time step. A pure function of its arguments.
/// @throws Error for settings or a motion that make no sense, a force that the servo doesn't reach (its stall torque,
/// or largest_closing_mm), or if the finger goes beyond what the face was solved for
FingerRun play_servo_finger(const GrippedFace& face, const ServoFingerSettings& settings, const FingerMotion& motion,
                            double interval_s = 1e-3);

}  // namespace touchstone::sim
