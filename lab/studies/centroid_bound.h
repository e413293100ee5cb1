#pragma once
// How well any method can estimate where something in a picture is: the Cramer-Rao bound of a shift.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "render/imager/imager.h"

namespace touchstone::lab {

/// Fisher's information (1/px^2) on the shift of what a picture shows within `radius_px` of `centre_px`, if all else is
/// known:
///
///   I = sum over the raw pixels there of grad(e) grad(e)^T / var(e)
///
/// with e the mean electrons that the light frees in the pixel and var their variance in one exposure: shot noise, dark
/// noise and rounding, not the fixed pattern, which can be calibrated away. ([Kay1993, sec. 3.9]; the noise is taken to
/// be normal, of a variance that is itself known.) No unbiased estimate of the shift has a covariance below I^-1.
/// Gradients are central differences of the picture's own colour channel: a picture sharper than its pixels appears to
/// know a little less than it does. Pixels at the full well or the largest number know nothing. The light's own noise
/// adds what nobody knows: use pictures of little.
/// @param irradiance W/m^2 on the sensor, CV_32FC(bands)
/// @param centre_px pixel centres are at + 0.5
/// @throws Error unless the picture has the imager's bands
Eigen::Matrix2d shift_information(const cv::Mat& irradiance, const render::Imager& imager,
                                  const Eigen::Vector2d& centre_px, double radius_px);

/// The same of any n numbers that the picture depends on, over all of it: n x n. `slopes` are the derivatives of the
/// light by each of them. @throws Error likewise @pre there is a slope, all as large as the picture
Eigen::MatrixXd picture_information(const cv::Mat& irradiance, const std::vector<cv::Mat>& slopes,
                                    const render::Imager& imager);

/// Mean of the least standard deviations of x and y, px: sqrt(trace(I^-1) / 2); infinite where one of them can't be
/// estimated.
double least_deviation_px(const Eigen::Matrix2d& information);

}  // namespace touchstone::lab
