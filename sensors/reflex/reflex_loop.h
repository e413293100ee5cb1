#pragma once
// Reflex mode [Knoop2013, sec. II and III.D]: each frame's statistics go straight to a decision, which goes straight to
// the actuator, past whoever controls it.

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "sensors/reflex/motion_counts.h"
#include "sensors/reflex/reflex_model.h"

namespace touchstone::sensors {

/// Why a frame's statistics can't be believed.
enum class ChipFault {
  none,
  impossible,  ///< no chip can have sent this: registers out of range, a disturbed line
  dark,        ///< all pixels are black: no lamp
  saturated,   ///< the darkest pixel is white: light from outside, or a lamp's supply
  flat,        ///< all pixels are alike: no dots in view
  no_features  ///< there is contrast, but the chip can't find a feature: the dots are lost or out of focus
};
/// For messages; "none" without a fault.
std::string name_of(ChipFault fault);

/// No allocation. A picture that's flat to within `flat_range` steps has no dots.
ChipFault fault_of(const ChipStatistics& statistics, int flat_range = 3);

/// When the actuator is stopped.
struct ReflexSettings {
  double stop_above_N = 0.0;    ///< with 0 any force that the tree sees stops
  int stop_frames = 1;          ///< frames in a row that must say so
  int release_frames = 15;      ///< MotionCounts; 10 ms
  bool stop_when_blind = true;  ///< stop also if nothing can be believed for `blind_frames` in a row
  int blind_frames = 3;
};

/// @throws Error that names the setting, its value and what is allowed
void check(const ReflexSettings& settings);

/// What one frame leads to.
struct ReflexDecision {
  ChipFault fault = ChipFault::none;  ///< if there is one, the forces are those of the last frame without
  bool force_present = false;
  double force_N = 0.0;                               ///< 0 without force
  Eigen::Vector2d shear_N = Eigen::Vector2d::Zero();  ///< 0 without force, or without a law for it
  bool stop = false;                                  ///< to the actuator; stays until reset()
};

/// Give it each frame's statistics. It allocates nothing and knows nothing of clocks.
class ReflexLoop {
 public:
  /// @throws Error for a model with a fault, and as check()
  ReflexLoop(ReflexModel model, const ReflexSettings& settings);

  /// Decides on one frame. Never throws: what a chip can't say is ChipFault.
  ReflexDecision next(const ChipStatistics& statistics);

  /// Lets the actuator move again; shear is summed from here.
  void reset();

 private:
  ReflexModel model_;
  ReflexSettings settings_;
  MotionCounts counts_;
  ReflexDecision last_;
  int above_ = 0;  // frames in a row
  int blind_ = 0;  // frames in a row
};

/// From a touch to the actuator, us. What the chip takes is its data sheet's.
struct ReflexBudget {
  double frame_us = 1e6 / 1500.0;  ///< a touch waits for the end of the frame that sees it
  /// Each register is asked for by a byte and given as a byte at most at 2 MHz, with 100 us between the two (the
  /// two-wire port's hold time).
  double register_us = 108.0;
  int registers = 4;         ///< SQUAL, MAX, MIN, Pixel_Sum; two more for shear
  double decision_us = 0.0;  ///< measured
  double actuator_us = 0.0;  ///< from the decision to where the actuator begins to brake

  /// The least: touch at a frame's very end.
  double after_frame_us() const { return registers * register_us + decision_us + actuator_us; }
  double mean_us() const { return 0.5 * frame_us + after_frame_us(); }  ///< touch at any time
  /// Touch just after a frame was exposed, and a host that is still reading the frame before when this one is ready.
  double most_us() const { return frame_us + registers * register_us + after_frame_us(); }
};

}  // namespace touchstone::sensors
