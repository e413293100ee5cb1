#pragma once
// Explore mode [Knoop2013, sec. III.E]: from each picture of the dots to their motion since rest. Absolute while the
// picture correlates with the one at rest, else step by step; a picture without information is reported, with the
// reason.

#include <cstdint>
#include <string>

#include "core/frame.h"
#include "sensors/reflex/dots_flow.h"
#include "sensors/reflex/dots_match.h"

namespace touchstone::sensors {

/// Where the motion of a picture comes from.
enum class ExploreMode {
  absolute,  ///< against the picture at rest: no drift
  relative,  ///< a step from an earlier picture
  held       ///< nothing could be measured: the motion is that of the last picture that gave one
};
/// "absolute", "relative" or "held".
std::string name_of(ExploreMode mode);

/// Why a picture can't be used.
enum class PictureFault {
  none,
  foreign,    ///< another size or type than the picture at rest
  dark,       ///< no pixel above 3 % of white
  saturated,  ///< more than half of the pixels white
  flat,       ///< black to white less than 5 % of the range
  no_dots,    ///< hardly any fine structure: the dots are lost, or out of focus
  jump        ///< neither rest nor the last pictures are recognised: too large a motion, or a damaged skin
};
/// For messages; "none" without a fault.
std::string name_of(PictureFault fault);

/// From which correlations on a motion is believed, and how steps are measured.
struct ExploreSettings {
  double absolute_from = 0.95;  ///< correlation with the picture at rest, the paper's
  DotsMatchSettings match;
  DotsFlowSettings flow;
  /// Look for a step's best correlation, from where the flow says and from where the motion was going. false: the
  /// flow's answer is taken, as in the paper; with dots of 1.5 px it is short by a third.
  bool step_by_match = true;
  /// A step is believed if the picture, warped back by it, correlates so well with the one it was measured against.
  /// -1: always, as in the paper.
  double step_correlation = 0.8;
  /// Steps are measured against the last picture but one as long as that correlates better than `key_correlation`, and
  /// so on back: errors add up over key pictures and not over all. Above 1: against the last picture, as in the paper.
  double key_correlation = 0.9;
  double search_reach_px = 4.0;  ///< when held, rest is sought with shifts up to this; 0: not sought
  /// A Gaussian laid over all pictures, for such as have more noise than a chip's; it costs dots at the picture's edge.
  double blur_px = 0.0;
  double white = 63.0;  ///< the largest number of a pixel
  PixelTimes times;     ///< when each pixel was taken; empty: all at once, or not known, as in the paper
};

/// The paper's algorithm as it stands.
ExploreSettings text_explore_settings();

/// @throws Error that names the setting, its value and what is allowed
void check(const ExploreSettings& settings);

/// The motion in one picture, and how sure it is.
struct ExploreReading {
  std::int64_t t_us = 0;  ///< what the motion is of: the mean of the pixels' times
  ExploreMode mode = ExploreMode::held;
  PictureFault fault = PictureFault::none;  ///< other than none exactly if the mode is `held`
  DotsMotion motion;
  double correlation = 0.0;       ///< with the picture at rest, at the best motion found
  double overlap = 0.0;           ///< the part of the picture at rest that is in view there
  double step_correlation = 0.0;  ///< with the picture that a step was measured against; 0 in absolute mode
};

/// Takes pictures in their order. One object is for one thread.
class ExploreTracker {
 public:
  /// `rest`: the picture without force, of type CV_8UC1, or CV_32FC1 if it's the mean of several.
  /// @throws Error as check(), for a picture at rest that has a fault, or times of another size
  ExploreTracker(const cv::Mat& rest, const ExploreSettings& settings);

  /// Takes the next picture (CV_8UC1). Its time is that of its first pixel. Never throws for what a camera shows.
  /// @throws Error for a time that isn't after that of the picture before, or beyond 2^61 us; nothing has then changed
  const ExploreReading& next(const Frame& frame);

  const ExploreReading& last() const { return reading_; }

 private:
  /// A picture and the motion in it.
  struct Key {
    DotsPicture picture;
    DotsMotion motion;
  };
  PictureFault find_fault(const cv::Mat& picture) const;
  bool take_absolute(const DotsPicture& picture);
  bool take_step(const DotsPicture& picture);
  void hold(PictureFault fault);

  ExploreSettings settings_;
  double rest_structure_ = 0.0;
  double middle_s_ = 0.0;
  DotsPicture rest_;
  Key key_, last_;
  bool has_begun_ = false;  // a picture was taken, with or without fault: reading_ has its time
  std::int64_t last_t_us_ = 0;
  bool has_last_ = false;   // of the frame before this one, without fault
  DotsMotion before_last_;  // for where the motion is going
  bool has_before_last_ = false;
  ExploreReading reading_;
};

}  // namespace touchstone::sensors
