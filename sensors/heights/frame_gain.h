#pragma once
// How much a frame's white balance and exposure differ from the rest frame's.

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sensors/heights/background.h"

namespace touchstone::sensors {

/// By what a frame's channels are stronger than the background's where nothing has changed.
struct FrameGain {
  cv::Vec3d gain{1.0, 1.0, 1.0};  ///< BGR
  /// Share of the pixels whose means over 7 x 7 are the background's, within 8 % in all channels, once the gain is
  /// taken out. Recorded presses of a ball on a GelSight Mini have 0.47 or more; upside down or mirrored, 0.33 or less.
  double alike = 1.0;
};

/// Finds the gains of frames blindly: a channel's is the commonest ratio to the background, both as means over 7 x 7
/// pixels, so a contact doesn't move it as long as the largest part of the picture with one ratio is gel at rest.
/// Bright parts of the background aren't asked, since they are the first to be cut off at 255 by another gain. Made
/// once for a background; then a frame of 320 x 240 costs 0.8 ms. Not for two threads at once.
class GainFinder {
 public:
  /// @pre the background's mean is CV_32FC3
  explicit GainFinder(const Background& background);

  /// @pre frame is CV_8UC3 of the background's size
  FrameGain find(const cv::Mat& frame);

 private:
  double commonest();  ///< of the histogram

  /// A pixel that is asked.
  struct Sample {
    int u = 0;
    int v = 0;
    std::array<float, 3> log_rest{};
    std::array<bool, 3> counts{};  ///< for the channel's gain
  };
  std::vector<Sample> samples_;
  cv::Mat smooth_frame_;
  std::vector<float> logs_;           ///< of each sample, one channel
  std::vector<unsigned char> alike_;  ///< whether each sample is, so far
  std::vector<float> histogram_, smooth_, kernel_;
  cv::Size size_;
};

}  // namespace touchstone::sensors
