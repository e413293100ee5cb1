#pragma once
// Where on the gel a pixel looks: a lens and a refracting plate bend a regular grid by percents, which is millimetres
// over a picture. Fitted to marks at known places, and taken out of height images before they are registered.

#include <Eigen/Core>
#include <span>

#include "sensors/touch_map/touch_image.h"

namespace touchstone::sensors {

/// Pixel (continuous indices, whole numbers at centres) as cubic polynomials of the place on the gel (mm).
struct PlaceMap {
  cv::Size size;                                                              ///< of the picture
  Eigen::Matrix<double, 10, 2> terms = Eigen::Matrix<double, 10, 2>::Zero();  ///< of 1, x, y, x^2, xy, y^2, x^3, ...
  double rms_px = 0.0;                                                        ///< of the fit, over the marks
  double mm_per_px = 0.0;                                                     ///< in the picture's middle

  /// The pixel that sees a place of the gel (mm).
  Eigen::Vector2d pixel_of(const Eigen::Vector2d& place) const;
};

/// @throws Error for fewer than 20 marks, another number of places than pixels, what isn't finite, or marks that don't
/// determine the polynomials (all on a line, or in few rows)
PlaceMap fit_place_map(std::span<const Eigen::Vector2d> pixels, std::span<const Eigen::Vector2d> places,
                       const cv::Size& size);

/// A touch on a regular grid of `mm_per_px` of the map, as large as the picture, its origin at the place (0, 0). Pixels
/// that the picture doesn't show aren't touched. @throws Error for images of another size than the map's, or as
/// `check(touch)` does
TouchImage rectified(const cv::Mat& height_mm, const cv::Mat& contact, const PlaceMap& map);

}  // namespace touchstone::sensors
