#pragma once
// A small picture of dots, ready to be looked up between its pixels.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace touchstone::sensors {

/// When the pixels of a picture were taken that is grabbed pixel by pixel, s after the first: CV_32FC1, as large as the
/// picture. Empty: all at once.
using PixelTimes = cv::Mat;

/// Those of a motion chip's picture (core/pixel_grab.h). @throws Error for an interval that isn't above 0 and finite
PixelTimes chip_pixel_times(double interval_s = 1.0 / 1500.0);

/// Pixels as numbers, places from the picture's middle.
class DotsPicture {
 public:
  DotsPicture() = default;
  /// `blur_px`: the standard deviation of a Gaussian that is laid over the picture first; 0: none.
  /// @throws Error for a picture that isn't CV_8UC1 or CV_32FC1 of at least 8x8 finite pixels
  explicit DotsPicture(const cv::Mat& picture, double blur_px = 0.0);

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  bool empty() const { return values_.empty(); }
  double at(int row, int column) const { return values_[static_cast<std::size_t>(row * columns_ + column)]; }
  /// px from the picture's middle.
  Eigen::Vector2d place_of(int row, int column) const {
    return {column - 0.5 * (columns_ - 1), row - 0.5 * (rows_ - 1)};
  }

  /// Bilinear; outside as at the nearest edge.
  double at(const Eigen::Vector2d& place) const;
  /// 1 inside, falling to 0 from half a pixel within the outermost pixels' middles to half a pixel outside, so that
  /// what leaves the view fades.
  double inside(const Eigen::Vector2d& place) const;

 private:
  int rows_ = 0, columns_ = 0;
  std::vector<double> values_;
};

}  // namespace touchstone::sensors
