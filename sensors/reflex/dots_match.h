#pragma once
// Explore mode's absolute estimate [Knoop2013, eqs. 5 to 7]: the motion that makes a picture correlate best with the
// picture at rest.

#include <span>

#include "sensors/reflex/dots_motion.h"
#include "sensors/reflex/dots_picture.h"

namespace touchstone::sensors {

/// How a picture that is grabbed pixel by pixel is skewed: each pixel shows the motion at its own time, which goes by
/// `velocity` from the one asked for at `middle_s`.
struct DotsSkew {
  const PixelTimes* times = nullptr;  ///< nothing: not skewed
  double middle_s = 0.0;
  DotsVelocity velocity;

  /// Where a dot that rests at `place` is seen.
  Eigen::Vector2d seen(const DotsMotion& motion, const Eigen::Vector2d& place) const;
};

/// How alike the pictures are under a motion, and over how much of them.
struct DotsCorrelation {
  double correlation = 0.0;  ///< Pearson's, -1 to 1; 0 where nothing varies
  double overlap = 0.0;      ///< the part of the picture at rest that is still in view, 0 to 1
};

/// Of a picture, warped back by `motion`, with the picture at rest; where the warp leads out of the view nothing
/// counts.
/// @pre both of one size
DotsCorrelation correlate(const DotsPicture& picture, const DotsPicture& rest, const DotsMotion& motion,
                          const DotsSkew& skew = {});

/// Where the best motion is sought, and what is believed.
struct DotsMatchSettings {
  /// A peak with less in view isn't taken: few pixels always correlate somewhere. A dilation of 1.45 leaves 0.47.
  double least_overlap = 0.3;
  double first_step_px = 0.8;  ///< the simplex's size at the start, at the picture's edge
  int most_steps = 200;
  double least_dilation = 0.7, most_dilation = 2.0;  ///< what isn't believed
};

/// The best motion found; correlation -1 if nothing was.
struct DotsMatch {
  DotsMotion motion;
  double correlation = -1.0;
  double overlap = 0.0;
};

/// The best peak that Nelder and Mead's simplex ([Nelder1965], OpenCV's DownhillSolver) reaches from any of the starts.
/// With dots of two pixels and three to four pixels apart a start must be within some 1.5 px, at the picture's edge, of
/// the truth. @throws Error for settings out of range or pictures of different sizes; @pre at least one start
DotsMatch match_dots(const DotsPicture& picture, const DotsPicture& rest, std::span<const DotsMotion> starts,
                     const DotsMatchSettings& settings = {});

/// How a picture is skewed if the motion grew evenly from `before` over `interval_s`: the skew depends on the motion
/// that is sought, so it is found along with it.
struct KeyFrameHistory {
  DotsMotion before;
  double interval_s = 0.0;  ///< between the two pictures' middles; 0: nothing is known, no skew
};
/// As match_dots(). @throws Error also for times that don't fit the picture
DotsMatch match_skewed_dots(const DotsPicture& picture, const DotsPicture& rest, std::span<const DotsMotion> starts,
                            const DotsMatchSettings& settings, const PixelTimes& times, const KeyFrameHistory& past);

/// The best correlation on a grid over all that the settings allow, shifts up to `reach_px`: a start where nothing is
/// known. Steps are three quarters of a pixel at the picture's edge.
DotsMatch search_dots(const DotsPicture& picture, const DotsPicture& rest, double reach_px,
                      const DotsMatchSettings& settings = {});

}  // namespace touchstone::sensors
