#pragma once
// Frame in, height map out, of a gel that shows depth as darkness [Lin2023]: each pixel's darkening is looked up in the
// calibration's curve; nothing is integrated.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sensors/heights/darkness_model.h"
#include "sensors/heights/height_map.h"

namespace touchstone::sensors {

/// Why a pixel's height is in doubt: bits of DarknessResult::doubt.
enum Doubt : unsigned char {
  kSaturated = 1,  ///< a channel is at 255: the place is brighter than shown, so its height is lower
  kUnlit = 2,      ///< the rest picture is too dark there: the height is 0, unmeasured
  kDeeper = 4,     ///< darker than any calibrated place: the curve goes on straight
  kBulged = 8      ///< brighter than any calibrated place: the gel bulges, or more light comes; the height is held
};

/// What is contact, and which frames are flagged.
struct DarknessSettings {
  ContactRule contact{.floor_mm = 0.1, .share = 0.35};  ///< light that changes by 2 % is some 0.1 mm
  double most_saturated = 0.02;                         ///< share of saturated pixels from which a frame is flagged
  double most_dark = 0.5;                               ///< share of black pixels, likewise
};

/// What one frame gives. The images stay valid until the estimator's next frame.
struct DarknessResult {
  cv::Mat height_mm;  ///< CV_32FC1, see height_map.h
  cv::Mat doubt;      ///< CV_8UC1: bits of Doubt, 0 where there's none
  cv::Mat contact;    ///< CV_8UC1: 255 where ContactRule says contact
  int contact_pixels = 0;
  double exposure = 1.0;           ///< the frame's over the rest picture's, as found at the border
  bool exposure_followed = false;  ///< false: the border's pixels don't agree, or following is off; exposure is 1
  double saturated_share = 0.0;    ///< of the pixels: a channel is at 255
  double dark_share = 0.0;         ///< all channels are 0
  double deeper_share = 0.0;       ///< kDeeper
  double bulged_share = 0.0;       ///< kBulged
  bool overexposed = false;        ///< more saturated pixels than the settings allow
  bool dark = false;               ///< more black pixels than the settings allow
  bool contact_at_border = false;  ///< the contact runs out of the picture

  bool trusted() const { return !overexposed && !dark; }
};

/// Made once for a model; then every frame costs the same. Not for two threads at once.
class DarknessEstimator {
 public:
  /// @throws Error if the model is faulty
  explicit DarknessEstimator(const DarknessModel& model, const DarknessSettings& settings = {});

  /// @throws Error if the frame isn't of the model's size and channels
  const DarknessResult& estimate(const cv::Mat& frame);

 private:
  DarknessModel model_;
  DarknessSettings settings_;
  DarkeningMeter meter_;
  std::vector<float> table_;  // heights at the knots, on to darkening 1
  DarknessResult result_;
};

}  // namespace touchstone::sensors
