#pragma once
// From a colour camera's numbers to CIE colours: what a user of a sensor that looks at skin calibrates once.
//
// - Flat field: a picture of an even white card through the gel. Lamps, the hole's fall-off and the colour of the light
//   divide out of every later picture, place by place.
// - A 3 x 3 matrix from what is left to XYZ under D65, fitted by least squares to patches of known colour. No matrix is
//   right for all spectra: a camera's filters aren't combinations of the eye's (Luther's condition).

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <span>

namespace touchstone::sensors {

/// A white card's picture, smooth and with a mask of where it is white at all.
struct FlatField {
  cv::Mat white;    ///< CV_32FC3, B G R, digital numbers
  cv::Mat trusted;  ///< CV_8UC1, 255 where the card is seen: not behind beads, neither dark nor at the largest number
};

/// @param card pictures of the same card, CV_8UC3, of one size: noise is averaged
/// @param smooth_px standard deviation of the smoothing, within what is trusted; 0 for none
/// @throws Error for no pictures, of another type or of different sizes, or where less than a tenth is to be trusted
FlatField flat_field(std::span<const cv::Mat> card, double smooth_px);

/// Mean over the trusted pixels of `mask` (CV_8UC1, not 0 = counts) of the picture by the white, as (R, G, B): 1 is
/// white.
/// @throws Error if the sizes differ or no pixel is left
Eigen::Vector3d mean_of_white(const cv::Mat& picture, const FlatField& field, const cv::Mat& mask);
/// The same without a flat field: by one white for the whole picture, that of the field's middle ninth.
Eigen::Vector3d mean_of_one_white(const cv::Mat& picture, const FlatField& field, const cv::Mat& mask);

/// XYZ under D65 from (R, G, B) of white.
struct ColourMatrix {
  Eigen::Matrix3d xyz_from_rgb = Eigen::Matrix3d::Identity();

  /// CIE L*a*b* of (R, G, B) of white, D65.
  Eigen::Vector3d lab(const Eigen::Vector3d& rgb) const;
};

/// One row a patch. @throws Error for fewer than three patches, or if they don't determine the matrix
ColourMatrix fit_colour_matrix(const Eigen::MatrixX3d& rgb, const Eigen::MatrixX3d& xyz);

}  // namespace touchstone::sensors
