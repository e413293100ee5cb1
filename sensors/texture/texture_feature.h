#pragma once
// The multi-scale local binary pattern of [Li2015, sec. 5.2.2]: histograms of uniform patterns on the levels of a
// Gaussian pyramid.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sensors/texture/local_binary_pattern.h"

namespace touchstone::sensors {

/// The circle of neighbours and the levels of the pyramid.
struct TextureOperator {
  LbpCircle circle;
  int levels = 4;  ///< n, of the pyramid, 1 to 8

  bool operator==(const TextureOperator&) const = default;
};

/// @throws Error for a circle or a number of levels out of range
void check(const TextureOperator& op);

/// Numbers in a feature: n (P + 2).
int feature_size(const TextureOperator& op);

/// The smallest side, px, of an image whose every level has a label.
int least_side(const TextureOperator& op);

/// Eq. 10: the histograms of levels i = 0 to n - 1, each times 2^i, one after another; then divided by their sum and
/// the square root taken of each (sec. 5.2.3), so that a feature has Euclidean length 1.
/// @param gray CV_8UC1, from least_side() a side @throws Error for another kind or a smaller one
Eigen::VectorXf texture_feature(const cv::Mat& gray, const TextureOperator& op);

}  // namespace touchstone::sensors
