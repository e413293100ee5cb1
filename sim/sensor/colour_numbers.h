#pragma once
// A colour camera's numbers of light, and light of its numbers: what is learned from a unit's frames is in the one,
// what is rendered in the other. Numbers are of 255, linear (no limits, no rounding), behind white balance, before the
// tone curve, without black level; red, green, blue.

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "render/imager/imager.h"

namespace touchstone::sim {

/// 3 x bands: numbers a W/m^2. @throws Error if the imager is grey
Eigen::Matrix3Xd numbers_per_irradiance(const render::Imager& imager);

/// bands x 3: what is to be added to light to change numbers by one, by the least sum of squares.
/// @throws Error if the imager is grey, or its three colours aren't independent
Eigen::MatrixX3d irradiance_per_number(const render::Imager& imager);

/// `light` (CV_32FC(bands)) in numbers, CV_32FC3.
cv::Mat linear_numbers(const cv::Mat& light, const Eigen::Matrix3Xd& numbers_per_irradiance);

/// Numbers as a camera with this tone curve delivers them (three channels blue, green, red, of 255) in linear ones,
/// CV_32FC3.
cv::Mat linear_of_delivered(const cv::Mat& delivered, const render::ToneCurve& curve);

/// `light` changed by `numbers` (CV_32FC3); no band gets below zero. @pre of the same size, light is CV_32FC(bands)
cv::Mat with_numbers(const cv::Mat& light, const cv::Mat& numbers, const Eigen::MatrixX3d& irradiance_per_number);

}  // namespace touchstone::sim
