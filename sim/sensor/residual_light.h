#pragma once
// A residual map (sim/scene/residual_map.h) as light on the sensor: what is added to the pictures of a coated gel
// before its camera turns them into numbers.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "render/cameras/first_hits.h"
#include "render/imager/imager.h"
#include "sim/scene/residual_map.h"
#include "sim/view/visible_gel.h"

namespace touchstone::sim {

/// Descriptions of pixels, a column each: ResidualMap::features() numbers in the map's units, slopes along u and v and
/// depth of each neighbourhood, then the place. `height`: as Touch::height (NaN counts as 0). `stride`: of every so
/// many columns and rows. Only neighbourhoods, scales and mm_per_px of the map are looked at.
/// @pre height is CV_32FC1, stride > 0
Eigen::MatrixXd residual_features(const ResidualMap& map, const cv::Mat& height, int stride = 1);

/// The bumps of the map's formula, a row a centre, a column a description. `place`: the last two numbers are places.
Eigen::MatrixXd residual_bumps(const Eigen::MatrixXd& centres, const Eigen::MatrixXd& features, bool place);

/// The correction of each pixel: CV_32FC3, red, green, blue, in numbers of 255 of linear light behind white balance,
/// before the tone curve (colour_numbers.h). The same bytes for any number of threads. @pre height is CV_32FC1 of the
/// map's size
cv::Mat residual_numbers(const ResidualMap& map, const cv::Mat& height);

/// A map for one camera.
class ResidualLight {
 public:
  /// @throws Error if the imager is grey, or its three colours aren't independent
  ResidualLight(ResidualMap map, const render::Imager& imager);

  /// Adds what the map says to `light` (CV_32FC(bands)), spread over the bands by the least sum of squares that gives
  /// these numbers; no band gets below zero. @pre both pictures have the map's size
  cv::Mat corrected(const cv::Mat& light, const cv::Mat& height) const;

 private:
  ResidualMap map_;
  Eigen::MatrixX3d irradiance_per_number_;
};

/// How far what each pixel sees is pressed in: Touch::height. @pre both have a hit a pixel; surface 0 is the membrane
cv::Mat pressed_in(const std::vector<render::FirstHit>& rest, const std::vector<render::FirstHit>& now, cv::Size size);
/// Which pixels see membrane that lies on an object: Touch::contact. `sheet` is the membrane of `now`. @pre likewise
cv::Mat in_contact(const std::vector<render::FirstHit>& rest, const std::vector<render::FirstHit>& now,
                   const GelSheet& sheet, cv::Size size);

}  // namespace touchstone::sim
