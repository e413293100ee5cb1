#pragma once
// How much darker than at rest each place of a picture is: what a gel with a milky layer under a black skin shows where
// it is pressed in [Lin2023].
//
// The darkening is 1 - frame / (exposure * rest): 0 at rest, above 0 where it's darker. It is a ratio, because what
// differs from place to place (the lamps' fall-off, the lens's) and from frame to frame (exposure) are factors. A
// logarithm of the ratio would hold no more: the curve to height takes any monotone form.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace touchstone::sensors {

/// The brightness of the untouched gel. Brightness is the mean of a picture's channels, digital numbers.
struct RestPicture {
  cv::Mat mean;                    ///< CV_32FC1
  int channels = 3;                ///< of the frames: 3 (BGR) or 1 (grey)
  int frames = 0;                  ///< how many it is the mean of
  std::optional<double> noise_DN;  ///< standard deviation of one frame's brightness; from two frames on
};

/// Where the rest picture is darker than this, nothing is measured.
inline constexpr float kDarkestRest_DN = 8.0F;

/// The mean of frames without contact.
/// @throws Error if there is none, if one isn't of 8 bit with 1 or 3 channels, differs from the first in size or
///   channels, has more than 1 % saturated pixels, or if less than half of the picture is lit
RestPicture mean_rest(std::span<const cv::Mat> frames);

/// What makes a picture unfit as a frame of the sensor that `rest` shows, or the empty string.
std::string unfit_frame(const cv::Mat& frame, const RestPicture& rest);

/// Largest DarkeningSettings::smoothing_px.
inline constexpr double kMostSmoothing_px = 10.0;

/// What is done before a frame is held against the rest picture.
struct DarkeningSettings {
  /// Take the exposure from the picture's border, where the gel is taken to be at rest. Without it exposure is 1: for
  /// locked cameras, and for presses that cover most of the border, which else are taken for a change of exposure.
  bool follow_exposure = true;
  double smoothing_px = 1.5;  ///< standard deviation of the Gaussian that the darkening is smoothed by; 0 is none
};

/// One frame's darkening. The pictures stay valid until the meter's next frame.
struct Darkening {
  cv::Mat map;                     ///< CV_32FC1; 0 where the rest picture is unlit
  cv::Mat saturated;               ///< CV_8UC1: 255 where a channel is at 255
  double exposure = 1.0;           ///< the frame's over the rest picture's
  bool exposure_followed = false;  ///< `exposure` was measured: the border's pixels agree about it
  double saturated_share = 0.0;    ///< of the pixels
  double dark_share = 0.0;         ///< of the pixels: all channels are 0
};

/// Made once for a rest picture; then frames are measured without allocating. Not for two threads at once.
class DarkeningMeter {
 public:
  /// @pre `rest` was made by mean_rest or checked by fault_of
  explicit DarkeningMeter(const RestPicture& rest, const DarkeningSettings& settings = {});

  /// @throws Error if the frame is unfit
  const Darkening& measure(const cv::Mat& frame);

  /// CV_8UC1: 255 where the rest picture is too dark.
  const cv::Mat& unlit() const { return unlit_; }

 private:
  void follow_exposure();

  RestPicture rest_;
  DarkeningSettings settings_;
  cv::Mat inverse_, lit_, unlit_;  // one over the rest's sum of channels; 1 or 0
  cv::Mat planes_[3], sum_;
  std::vector<int> border_;  // pixels, row by row
  std::vector<float> ratios_;
  Darkening result_;
};

}  // namespace touchstone::sensors
