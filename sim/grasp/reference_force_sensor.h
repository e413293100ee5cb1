#pragma once
// The piezoresistive film that the force estimates are trained and judged against ([Naeini2020, sec. V.B]: FlexiForce
// A201 on the dynamic finger under a layer of silicone), with its errors: what it reads isn't the force.
//
// Figures of its public data sheet [FlexiForceA201]: linearity +-3 % and hysteresis < 4.5 % of full scale,
// repeatability +-2.5 %, drift < 5 % per decade of time, response < 5 us. The paper adjusted it to 111 N and used 3.7 N
// of them: 4.5 % of 111 N would be more than all that it measured, so hysteresis and linearity are here relative to how
// far the force went. Each effect is off at 0.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/grasp/servo_finger.h"

namespace touchstone::sim {

/// The film's errors; 0 turns off each of them that can be.
struct ReferenceForceSensorSettings {
  double window_s = 0.007;  ///< one reading each (sec. V.B)
  /// The reading on unloading from a peak P less that on loading is this part of P at no force, where it is
  /// largest. Rate-independent; see HysteresisLoop.
  double hysteresis = 0.045;
  double gain_error = 0.025;       ///< repeatability: each grasp has its gain within 1 +- that
  double drift_per_decade = 0.05;  ///< of the force, per decade of time under load from 0.1 s on; right after 1 s
  /// Of the silicone on the film and of the film's bending: the reading follows with this lag. Not on the data sheet;
  /// the paper sees its sensor fall over several windows where the force has gone at once (V.C, fig. 9).
  double lag_s = 0.020;
  double full_scale_N = 111.0;  ///< sec. V.B
  int adc_bits = 10;            ///< an Arduino's converter over the full scale: steps of 0.11 N; 0: none
  double noise_N = 0.03;        ///< standard deviation of a reading
  double carried_g = 2.0;       ///< what lies before the film and is accelerated with the finger (sec. V.C)
  double shaken_N_s_mm = 2e-3;  ///< standard deviation of a reading per mm/s of the finger: film and leads bend
  int median = 3;               ///< readings, odd: "third-order median filter" (sec. V.B); 1: none
};

/// What one window of the sensor gives, with what it should have given.
struct ForceReading {
  double seconds = 0.0;     ///< the window's end, when it is read
  double true_N = 0.0;      ///< mean force on the finger over the window
  double raw_N = 0.0;       ///< as read
  double measured_N = 0.0;  ///< after the median filter: what the paper calls the measured force
};

/// Rate-independent hysteresis by Prandtl's and Ishlinskii's play operators [Brokate1996, sec. 2.4]. Its first loading
/// is the power law P (F/P)^alpha / P^0 with 2^(1-alpha) = 1 - width, normalised at `scale`; Masing's rule then leaves
/// `width` of a peak's reading when the force has gone, for loops of any size. The power law's own deviation from the
/// straight line is 2.4 % at 4.5 %: within the sheet's linearity.
class HysteresisLoop {
 public:
  /// @throws Error unless 0 <= width < 0.5 and scale > 0
  HysteresisLoop(double width, double scale);
  /// The reading of the next force. All forces before it count.
  double next(double force);

 private:
  std::vector<double> threshold_, weight_, play_;
};

/// Readings of a grasp, the first window beginning at `from_s`. A pure function of its arguments.
/// @throws Error for settings that make no sense, moments that aren't even in time, or where no whole window fits
std::vector<ForceReading> read_reference_force(std::span<const FingerMoment> moments, double from_s,
                                               const ReferenceForceSensorSettings& settings, std::uint64_t seed);

}  // namespace touchstone::sim
