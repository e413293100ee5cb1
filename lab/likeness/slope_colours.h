#pragma once
// What simulators that learn from examples do: a table from the membrane's ideal slope to the colour that it has. The
// baseline that a device's physics has to be measured against.

#include <opencv2/core/mat.hpp>

namespace touchstone::lab {

/// A membrane's slopes, rise over run along u and v: CV_32FC2, by central differences of a height map in mm (CV_32FC1,
/// NaN where nothing is seen, which counts as 0). @pre mm_per_px > 0
cv::Mat slopes_of(const cv::Mat& height, double mm_per_px);

/// Mean difference colour by slope: cells of 0.1 from -3 to 3 along u and v, slopes beyond belong to the last.
class SlopeColours {
 public:
  SlopeColours();
  /// @pre slopes CV_32FC2, difference CV_32FC3, of one size
  void learn(const cv::Mat& slopes, const cv::Mat& difference);
  /// Fills cells that nothing was learned for from those around them. Call it once, after all learn(), before
  /// colours().
  void finish();
  /// CV_32FC3, linear between cells.
  cv::Mat colours(const cv::Mat& slopes) const;

 private:
  cv::Mat sum_, count_;  // CV_64FC3, CV_64FC1
  cv::Mat mean_;         // CV_32FC3
};

}  // namespace touchstone::lab
