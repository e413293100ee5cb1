#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

namespace touchstone::sensors {

/// Thresholds of [Li2015, sec. 4.4.2], on the sum of the absolute differences of a pixel's three channels, each scaled
/// to 0..1: so the sum goes from 0 to 3, and 0.1 is 25.5 grey levels of 8 bit, over the channels together. The thesis
/// takes the absolute value for motion; for contact it says "the image with background subtracted", and the absolute
/// value is taken there too: pressed gel is darker on one side as it is brighter on the other. A grey
/// picture counts as one whose three channels are alike.
struct MotionRatioSettings {
  double contact_threshold = 0.1;
  double motion_threshold = 0.1;
  int least_contact_px = 50;  ///< fewer are noise, and no ratio is given
};

/// The two pictures' ratio, with what it is made of.
struct MotionRatio {
  int contact_px = 0;           ///< Ac: pixels in which the earlier picture differs from the background (fig. 4-8c)
  int motion_px = 0;            ///< Am: pixels in which the two pictures differ; may be more than Ac
  std::optional<double> ratio;  ///< rm = Am/Ac, where there is contact
};

/// Compares two pictures that follow each other. `contact`, if wanted, gets 255 where the *later* one differs from the
/// background, else 0; it's allocated only if it has another size.
/// @throws Error unless all three are BGR or all grey, 8 bit, not empty and of one size, and the thresholds from 0 to 3
MotionRatio motion_ratio(const cv::Mat& background, const cv::Mat& earlier, const cv::Mat& later,
                         const MotionRatioSettings& settings = {}, cv::Mat* contact = nullptr);

}  // namespace touchstone::sensors
