#pragma once
// How much of a frame shows the gel at rest, and a background that is followed as it drifts: lamps that warm up, a hot
// pixel, dust.

#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

/// What counts as the gel at rest, and how fast its picture is followed.
struct FollowSettings {
  /// A change is followed to 1 - 1/e of it within so many frames that show its place at rest; 0: it isn't. So it lags
  /// by what changes in so many frames.
  double frames = 0.0;
  /// What the mean of 8 x 8 pixels may differ from the background's in any channel to count as at rest.
  double still_DN = 4.0;
  /// Nearer to something that isn't at rest the gel slopes, and isn't followed: else a long press would fade into it.
  double reach_mm = 5.0;
};

/// Looks at blocks of 8 x 8 pixels. Made once for a picture; then it allocates nothing. Not for two threads at once.
class RestFollower {
 public:
  /// `mean` is the background's, CV_32FC3.
  /// @throws Error if a setting is negative or not a number @pre the scale is above 0
  RestFollower(const cv::Mat& mean, double mm_per_px, const FollowSettings& settings);

  /// Another background. @pre of the same size
  void take(const cv::Mat& mean);

  /// The share of the blocks that are at rest. `gain`: what the frame's channels are stronger by (frame_gain.h).
  /// @pre the planes are the frame's channels, CV_8UC1 of the mean's size
  double look(const cv::Mat (&planes)[3], const cv::Vec3d& gain);

  /// Moves the mean towards the frame that was looked at last where nothing touches, nor anything but a speck isn't at
  /// rest, within reach.
  /// @pre frame is CV_8UC3, mean the one that was taken last; contact is CV_8UC1, 0 where nothing touches
  void follow(const cv::Mat& frame, const cv::Vec3d& gain, const cv::Mat& contact, cv::Mat& mean);

 private:
  FollowSettings settings_;
  std::vector<cv::Vec3f> rest_;  ///< the mean's sums over the blocks, row by row
  std::vector<int> sums_;        ///< of one row of blocks and channel of a frame
  cv::Mat moved_;                ///< a pixel a block, CV_8UC1: 255 where it isn't at rest
  cv::Mat slopes_;               ///< the same without specks, and with what is in contact
  cv::Mat near_;                 ///< and with what is within reach
  cv::Mat disc_;                 ///< of that radius
};

}  // namespace touchstone::sensors
