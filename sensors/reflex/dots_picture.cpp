#include "sensors/reflex/dots_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/pixel_grab.h"

namespace touchstone::sensors {

PixelTimes chip_pixel_times(double interval_s) {
  if (!(interval_s > 0.0) || !std::isfinite(interval_s)) {
    fail("pixel times: an interval of {} s, it must be above 0 and finite", interval_s);
  }
  PixelTimes times(kChipSide, kChipSide, CV_32FC1);
  for (int frame = 0; frame < kChipPixels; ++frame) {
    const ChipPlace place = grabbed_place(frame);
    times.at<float>(place.row, place.column) = static_cast<float>(frame * interval_s);
  }
  return times;
}

DotsPicture::DotsPicture(const cv::Mat& picture, double blur_px) : rows_(picture.rows), columns_(picture.cols) {
  constexpr int kLeastSide = 8;
  if (picture.type() != CV_8UC1 && picture.type() != CV_32FC1) {
    fail("a picture of dots has OpenCV type {}, CV_8UC1 or CV_32FC1 is needed", picture.type());
  }
  if (rows_ < kLeastSide || columns_ < kLeastSide) {
    fail("a picture of dots has {}x{} pixels, at least {}x{} are needed", columns_, rows_, kLeastSide, kLeastSide);
  }
  cv::Mat numbers;
  picture.convertTo(numbers, CV_64F);
  if (blur_px > 0.0) cv::GaussianBlur(numbers, numbers, {}, blur_px, blur_px, cv::BORDER_REPLICATE);
  values_.assign(numbers.begin<double>(), numbers.end<double>());
  if (!std::all_of(values_.begin(), values_.end(), [](double value) { return std::isfinite(value); })) {
    fail("a picture of dots has pixels that aren't finite");
  }
}

double DotsPicture::at(const Eigen::Vector2d& place) const {
  const double x = std::clamp(place.x() + 0.5 * (columns_ - 1), 0.0, static_cast<double>(columns_ - 1));
  const double y = std::clamp(place.y() + 0.5 * (rows_ - 1), 0.0, static_cast<double>(rows_ - 1));
  const int column = std::min(static_cast<int>(x), columns_ - 2);
  const int row = std::min(static_cast<int>(y), rows_ - 2);
  const double right = x - column, down = y - row;
  const double* corner = &values_[static_cast<std::size_t>(row * columns_ + column)];
  const double top = corner[0] + right * (corner[1] - corner[0]);
  const double bottom = corner[columns_] + right * (corner[columns_ + 1] - corner[columns_]);
  return top + down * (bottom - top);
}

double DotsPicture::inside(const Eigen::Vector2d& place) const {
  const double across = 0.5 * columns_ - std::abs(place.x());
  const double along = 0.5 * rows_ - std::abs(place.y());
  return std::clamp(across, 0.0, 1.0) * std::clamp(along, 0.0, 1.0);
}

}  // namespace touchstone::sensors
