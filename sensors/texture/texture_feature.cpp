#include "sensors/texture/texture_feature.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/error.h"
#include "sensors/image/gaussian_pyramid.h"

namespace touchstone::sensors {

void check(const TextureOperator& op) {
  check(op.circle);
  if (op.levels < 1 || op.levels > kMostPyramidLevels) {
    fail("{} pyramid levels; from 1 to {} are allowed", op.levels, kMostPyramidLevels);
  }
}

int feature_size(const TextureOperator& op) {
  return op.levels * (op.circle.neighbours + 2);
}

int least_side(const TextureOperator& op) {
  int side = 2 * lbp_margin(op.circle) + 1;
  for (int level = 1; level < op.levels; ++level) side = 2 * side - 1;  // a side of n becomes (n + 1) / 2
  return side;
}

Eigen::VectorXf texture_feature(const cv::Mat& gray, const TextureOperator& op) {
  check(op);
  const int needed = least_side(op);
  if (gray.cols < needed || gray.rows < needed) {
    fail("the image is {} x {} px; {} pyramid levels with circles of {} px need at least {} x {}", gray.cols, gray.rows,
         op.levels, op.circle.radius_px, needed, needed);
  }
  const std::vector<cv::Mat> pyramid = gaussian_pyramid(gray, op.levels);
  Eigen::VectorXd counts(feature_size(op));
  Eigen::Index k = 0;
  for (int level = 0; level < op.levels; ++level) {
    const double weight = std::ldexp(1.0, level);
    for (const std::uint32_t count : lbp_histogram(pyramid[level], op.circle)) counts[k++] = weight * count;
  }
  return (counts / counts.sum()).cwiseSqrt().cast<float>();
}

}  // namespace touchstone::sensors
