#include "sensors/touch_map/touch_image.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::sensors {

TouchImage touch_by_height(const cv::Mat& height_mm, double mm_per_px, double contact_above_mm) {
  TouchImage touch{height_mm, {}, mm_per_px};
  if (height_mm.type() == CV_32FC1 && !height_mm.empty()) touch.contact = height_mm > contact_above_mm;
  check(touch);
  return touch;
}

cv::Mat higher_part(const cv::Mat& height_mm) {
  cv::Mat grey, mask;
  cv::normalize(height_mm, grey, 0.0, 255.0, cv::NORM_MINMAX, CV_8U);
  cv::threshold(grey, mask, 0.0, 255.0, cv::THRESH_BINARY | cv::THRESH_OTSU);
  return mask;
}

void check(const TouchImage& touch) {
  const cv::Mat& height = touch.height_mm;
  if (height.empty()) fail("the touch has no heights");
  if (height.type() != CV_32FC1) fail("the touch's heights must be one channel of 32 bit floats (CV_32FC1)");
  if (touch.contact.size() != height.size() || touch.contact.type() != CV_8UC1) {
    fail("the contact mask is {} x {}; it must be 8 bit, one channel and {} x {} as the heights are",
         touch.contact.cols, touch.contact.rows, height.cols, height.rows);
  }
  if (!(touch.mm_per_px > 0.0) || !std::isfinite(touch.mm_per_px)) {
    fail("the touch's pixels are {} mm wide; that must be above 0 and finite", touch.mm_per_px);
  }
  for (int v = 0; v < height.rows; ++v) {
    const float* row = height.ptr<float>(v);
    for (int u = 0; u < height.cols; ++u) {
      if (!std::isfinite(row[u])) fail("the height at pixel ({}, {}) is {}; it must be finite", u, v, row[u]);
    }
  }
}

PixelFrame touch_frame(const cv::Size& size, double mm_per_px) {
  return {0.5 * Eigen::Vector2d(size.width - 1, size.height - 1), mm_per_px};
}

double bilinear(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const int u = static_cast<int>(std::floor(pixel.x())), v = static_cast<int>(std::floor(pixel.y()));
  const double s = pixel.x() - u, t = pixel.y() - v;
  const auto value = [&](int column, int row) {
    const bool inside = column >= 0 && row >= 0 && column < image.cols && row < image.rows;
    return inside ? static_cast<double>(image.at<float>(row, column)) : 0.0;
  };
  return (1.0 - t) * ((1.0 - s) * value(u, v) + s * value(u + 1, v)) +
         t * ((1.0 - s) * value(u, v + 1) + s * value(u + 1, v + 1));
}

}  // namespace touchstone::sensors
