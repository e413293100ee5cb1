#pragma once
// The grasp rule of [Li2015, sec. 4.5] as a state machine: close until the height map says touch, lift, and close
// further whenever slip is seen.

#include <optional>
#include <string>

namespace touchstone::sensors {

/// How the rule goes about. Lengths are of one finger's travel: a gripper of two fingers closes by twice that.
struct GraspRuleSettings {
  /// Touch is where the height map's maximum exceeds this. The thesis's threshold is 2 without a unit; in a map that is
  /// integrated from slopes without a pixel pitch that is two pixels, 0.106 mm. Less takes less force to see a touch
  /// that is wide and flat; much less leaves patches on which slip can't be seen: an object with a radius of 20 mm has
  /// one of 1.7 mm here, which six markers lie on. An untouched gel shows at most 0.006 mm (gelsight-markers, 300
  /// frames).
  double touch_height_mm = 0.075;
  int touch_frames = 2;               ///< frames in a row that must say so: noise in one of them is no touch
  double approach_step_mm = 0.02;     ///< a frame, until touch
  double longest_approach_mm = 30.0;  ///< without touch after that the rule gives up
  double slip_step_mm = 0.05;         ///< each time that slip is seen
  /// After such a step slip isn't looked at for so many frames, and when lifting is done so many pass without slip
  /// before the object counts as held: what is seen is as old as the camera's lag (sec. 2.2.3: some 100 ms).
  int settle_frames = 3;
  double most_slip_travel_mm = 1.0;           ///< closing by slip ends here
  std::optional<double> most_normal_force_N;  ///< and at this estimated normal force, if one is given
  double lost_height_mm = 0.02;               ///< the object is lost where the maximum stays below this...
  int lost_frames = 5;                        ///< ...for so many frames in a row after touch
  bool react_to_slip = true;                  ///< false: the thesis's step 2 is left out, for comparison
};

/// @throws Error that names the setting, its value and what is allowed
void check(const GraspRuleSettings& settings);

/// What one frame says.
struct GraspReading {
  double height_max_mm = 0.0;  ///< of the height map, indentation positive
  bool slip = false;           ///< force ratio and motion ratio both over their thresholds
  std::optional<double> normal_force_N;
  bool lifted = false;  ///< the arm has reached its goal
};

/// Where a grasp is; a phase marked "ends" is its last one.
enum class GraspPhase {
  approaching,    ///< closing, no touch yet
  touched,        ///< the threshold is exceeded, but not yet in enough frames: the gripper waits
  lifting,        ///< the arm moves up
  holding,        ///< lifted, and no slip since
  nothing_there,  ///< ends: closed completely without touch
  slipping,       ///< ends: slip is seen, and the limits forbid to close further
  lost            ///< ends: the touch has gone
};
/// As the enumerators: "approaching", "nothing there", ...
std::string name_of(GraspPhase phase);
/// Is it one of the phases that a grasp fails in?
bool has_ended_badly(GraspPhase phase);

/// What the gripper and the arm shall do next.
struct GraspCommand {
  GraspPhase phase = GraspPhase::approaching;
  double close_by_mm = 0.0;  ///< each finger, now
  bool lift = false;         ///< the arm may move up; false: it stands
};

/// Give it one reading a frame. Deterministic; it knows nothing but what it was given.
class GraspRule {
 public:
  /// @throws Error as check()
  explicit GraspRule(const GraspRuleSettings& settings);

  /// @throws Error for a height or force that isn't finite
  GraspCommand next(const GraspReading& reading);

  GraspPhase phase() const { return phase_; }
  double approach_travel_mm() const { return approached_; }  ///< of each finger until touch
  double slip_travel_mm() const { return tightened_; }       ///< of each finger in answer to slip
  int slip_reactions() const { return answers_; }            ///< how often it closed further

 private:
  GraspCommand approach(const GraspReading& reading);
  GraspCommand lift(const GraspReading& reading);
  GraspCommand tighten(const GraspReading& reading);
  GraspCommand end(GraspPhase phase);

  GraspRuleSettings settings_;
  GraspPhase phase_ = GraspPhase::approaching;
  double approached_ = 0.0;
  double tightened_ = 0.0;
  int answers_ = 0;
  int touching_ = 0;  // frames in a row above the touch threshold
  int missing_ = 0;   // frames in a row below the lost threshold
  int settling_ = 0;  // frames in which slip isn't looked at
  int calm_ = 0;      // frames in a row without slip since the arm reached its goal
};

}  // namespace touchstone::sensors
