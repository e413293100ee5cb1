#pragma once
// The presses that the experiments of the reflex fingertip are made of ([Knoop2013, secs. III.C to IV], and what it
// leaves open), as paths for sim::PathPlayer. docs/sensors/reflex.md says what they cost.

#include <cstdint>
#include <functional>

#include "sim/press/force_law.h"
#include "sim/press/press_path.h"

namespace touchstone::lab {

/// What touches the fingertip. All are rigid.
enum class ReflexObject : std::uint8_t {
  plate,     ///< 60 mm wide, 30 mm thick
  ball,      ///< 12.7 mm in diameter
  cylinder,  ///< 10 mm in diameter, lying along x
  probe      ///< flat and round, 6 mm in diameter, its rim rounded by 0.5 mm
};
/// "plate", "ball", "cylinder", "probe"
const char* name_of(ReflexObject object);

/// One object, where and how tilted, and how deep it goes.
struct ReflexPress {
  ReflexObject object = ReflexObject::plate;
  double tilt_deg = 0.0;          ///< of the object's axis from z, to 30
  double tilt_towards_deg = 0.0;  ///< where the object's axis leans to, from x to y: there it touches first
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();  ///< of the object's own origin
  double friction = 0.5;                               ///< of rubber on a dry plate
  double deepest_mm = 5.0;                             ///< the paper's range
  double step_mm = 0.1;                                ///< from state to state, at most
};

/// Straight down from the touch; `at` is the depth under it (mm), from 0.
/// @throws Error for a depth or step that isn't finite and above zero, or a tilt or friction that isn't allowed
sim::PressPath press_down(const ReflexPress& press);

/// Down to `deepest_mm` as press_down, then sideways by `reach_mm` in the direction `towards_deg` (from x to y), back
/// through the middle to as far on the other side, and to the middle again, in steps of at most `shear_step_mm`. `at`
/// is the length of the path (mm). What sticks and slips depends on all of it.
/// @throws Error as press_down, and for a reach or step that isn't finite and above zero
struct ReflexShear {
  double reach_mm = 2.0;
  double towards_deg = 0.0;
  double shear_step_mm = 0.25;
};
/// The press, then the drag at its end.
sim::PressPath press_and_shear(const ReflexPress& press, const ReflexShear& shear);

/// N, the paper's eq. 1 for a plate pressed z_mm deep.
double published_reflex_force(double z_mm);
/// The paper's root mean square error of it to its own data, N: what a law that meets it may differ by.
inline constexpr double kReflexLawRms_N = 0.14;
/// Root mean square difference of a force at depths (mm) from eq. 1, over `count` of them evenly from 0 to 5 mm, both
/// ends included.
double reflex_law_rms(const std::function<double(double)>& force_N, int count = 51);
/// Of a law. @throws Error if it doesn't reach 5 mm
double reflex_law_rms(const sim::ForceLaw& law, int count = 51);

/// The law of a press_down on scenes/devices/reflex.yaml, with its error bar: under the plate, edges 0.7 times as long
/// give forces that differ by up to 3 % and 0.02 N below 2 mm and by 0.5 % beyond.
/// @throws Error as sim::force_law
sim::ForceLaw reflex_law(const ReflexPress& press, const sim::PlayedPath& played);

}  // namespace touchstone::lab
