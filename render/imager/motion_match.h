#pragma once
// How far a small picture has moved, as a motion chip finds it: by comparison with an earlier frame.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace touchstone::render {

/// By how much the content of `now` lies to the right of (x) and below (y) that of `before`, pixels (both CV_8UC1, of
/// one size, at least 9x9). Block matching: over shifts of up to kMatchReach pixels in each direction the mean squared
/// difference of the part of `now` that is in view of `before` at all of them; the least one, and the parabolas through
/// it and its neighbours along x and y.
struct MotionMatch {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  double difference = 0.0;  ///< mean squared, at the parabolas' lowest point: what the motion doesn't explain
};
inline constexpr int kMatchReach = 3;  ///< pixels, along each axis: motions further than that aren't found

/// @throws Error for other pictures
MotionMatch match_motion(const cv::Mat& now, const cv::Mat& before);

/// Counts the whole pixels that frames move by. What a frame has moved against the reference is added to what was left
/// over when that was taken; when it has come to a pixel, that is counted, and the frame is the new reference. So slow
/// motion isn't lost frame by frame, and a scene that stands still counts nothing however noisy it is. A reference that
/// has come to look different (pressed, in other light) is replaced as well: where the mean squared difference is above
/// kStaleDifference (DN^2) and above kStaleShare of the frame's variance. The way a mouse's chip does this isn't
/// public; this is ours.
class MotionCounter {
 public:
  /// Counts since the frame before, x and y. A frame of fewer features than kLeastFeatures moves by nothing.
  /// @throws Error as match_motion, if frames differ in size
  Eigen::Vector2i count(const cv::Mat& frame, int features);

 private:
  cv::Mat reference_;
  Eigen::Vector2d left_over_ = Eigen::Vector2d::Zero();
};
inline constexpr double kStaleDifference =
    4.0;                                    ///< grey levels squared; what a MotionMatcher takes a new key picture for
inline constexpr double kStaleShare = 0.2;  ///< likewise: of the picture's variance
inline constexpr int kLeastFeatures = 8;    ///< likewise: SQUAL below it

}  // namespace touchstone::render
