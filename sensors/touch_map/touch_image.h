#pragma once
// What one touch gives of the surface that was touched: heights over the sensor's pixels.
//
// Touch frame: origin at the image's centre, x along its rows (u, right), y along its columns (v, down), mm. So a
// positive angle turns clockwise as the image is looked at. Pixel (column u, row v) has its centre at
// ((u + 0.5 - cols / 2), (v + 0.5 - rows / 2)) * mm_per_px. Heights are positive where the membrane is pressed into
// the sensor.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace touchstone::sensors {

/// Heights and contact of one touch.
struct TouchImage {
  cv::Mat height_mm;       ///< CV_32FC1
  cv::Mat contact;         ///< CV_8UC1, not 0 where the object touches
  double mm_per_px = 0.0;  ///< of both axes
};

/// A touch whose contact is given by height alone: where it is above `contact_above_mm`.
/// @throws Error as `check` does
TouchImage touch_by_height(const cv::Mat& height_mm, double mm_per_px, double contact_above_mm);

/// Contact where the level of rest isn't known, as of heights with a free border: the higher of two classes of heights
/// [Otsu1979]. CV_8UC1, 255 in contact. @pre CV_32FC1, finite, not empty
cv::Mat higher_part(const cv::Mat& height_mm);

/// @throws Error for an image that is empty or of another type, a contact mask of another size or type, a height that
/// isn't finite, or a pitch that isn't above 0
void check(const TouchImage& touch);

/// Where a frame of mm lies on the pixels of an image.
struct PixelFrame {
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();  ///< the frame's origin in continuous pixel indices (column,
                                                        ///< row), where whole numbers are pixels' centres
  double mm_per_px = 0.0;

  Eigen::Vector2d pixel_of(const Eigen::Vector2d& point) const { return point / mm_per_px + origin_px; }
  Eigen::Vector2d point_of(const Eigen::Vector2d& pixel) const { return (pixel - origin_px) * mm_per_px; }
};

/// The touch frame of an image of this size.
PixelFrame touch_frame(const cv::Size& size, double mm_per_px);

/// Value between pixels by bilinear interpolation; 0 outside. @pre CV_32FC1
double bilinear(const cv::Mat& image, const Eigen::Vector2d& pixel);

}  // namespace touchstone::sensors
