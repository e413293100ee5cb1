#pragma once
// Are the pictures of two programs equal within their noise?

#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::bench {

/// Two sets of pictures of one thing, each picture drawn with a seed of its own.
struct PictureComparison {
  double mean_ratio = 0.0;   ///< of the second set's mean to the first's
  double ratio_error = 0.0;  ///< its standard error
  int blocks = 0;            ///< that were compared
  double mean_square_z = 0.0;
  double expected_mean_square_z = 0.0;  ///< of Student's t, as variances come from few pictures
  double mean_square_z_error = 0.0;     ///< standard deviation of mean_square_z if all is noise
  double largest_z = 0.0;               ///< in size

  /// Both figures within three standard errors of what noise alone gives.
  bool equal() const;
};

/// z-test for each block of `block` x `block` pixels: the difference of the two sets' means over the block, divided by
/// its standard error, which comes from how the block differs from picture to picture. So it doesn't matter whether the
/// pixels of one picture are independent. Blocks that are dark in all pictures are left out. First channel only.
/// @pre at least eight pictures in each set, all CV_32F of one size
PictureComparison compare_pictures(const std::vector<cv::Mat>& first, const std::vector<cv::Mat>& second, int block);

/// Noise of one picture of the set: root mean square over the pixels of the standard deviation from picture to picture,
/// over the mean of all. First channel. @pre at least two pictures
double relative_noise(const std::vector<cv::Mat>& pictures);

}  // namespace touchstone::bench
