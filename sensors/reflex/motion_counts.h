#pragma once
// How far the skin has moved sideways since a contact began: the sum of a motion-sensing chip's DX and DY. What sums up
// drifts, so it begins anew with each contact: without force there's no shear.

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "core/motion_chip.h"

namespace touchstone::sensors {

/// The sum, frame by frame. One object is for one thread.
class MotionCounts {
 public:
  /// `release_frames`: the sum is set to zero after so many frames in a row without force, so that a single frame
  /// that the tree gets wrong doesn't lose what was summed. @pre at least 1
  explicit MotionCounts(int release_frames = 15) : release_frames_(release_frames) {}

  /// Takes the next frame's motion and gives the sum, counts.
  Eigen::Vector2d next(const ChipStatistics& statistics, bool force_present) {
    absent_ = force_present ? 0 : std::min(absent_ + 1, release_frames_);
    if (absent_ >= release_frames_) {
      sum_ = {0, 0};
      frames_ = 0;
      return sum_.cast<double>();
    }
    sum_ += Eigen::Matrix<std::int64_t, 2, 1>(statistics.dx, statistics.dy);
    ++frames_;
    // A register at its end may have been cut off: what is lost never comes back.
    constexpr int kMost = 127, kLeast = -128;
    if (statistics.dx == kMost || statistics.dx == kLeast || statistics.dy == kMost || statistics.dy == kLeast) ++cut_;
    return sum_.cast<double>();
  }

  std::int64_t frames() const { return frames_; }  ///< summed since the contact began
  std::int64_t cut_off() const { return cut_; }    ///< of all frames, those with a register at its end

 private:
  int release_frames_;
  int absent_ = 0;
  std::int64_t frames_ = 0;
  std::int64_t cut_ = 0;
  Eigen::Matrix<std::int64_t, 2, 1> sum_{0, 0};
};

}  // namespace touchstone::sensors
