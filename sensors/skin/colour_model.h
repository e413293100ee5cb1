#pragma once
// Colours through a clear gel: a flat field and a matrix that were calibrated together, and their file.

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sensors/skin/colour_correction.h"

namespace touchstone::sensors {

/// A calibrated model of one device in one light, whose pictures are linear in light.
struct ColourModel {
  FlatField field;
  ColourMatrix matrix;
  int patches = 0;                 ///< that the matrix was fitted to
  double mean_error_de2000 = 0.0;  ///< of these, CIEDE2000
  double largest_error_de2000 = 0.0;
};

/// What is wrong with it; empty if nothing is.
std::string fault_of(const ColourModel& model);

/// A patch whose colour is known, as it is seen.
struct ColourPatch {
  Eigen::Vector3d rgb;  ///< mean_of_white of its pixels
  Eigen::Vector3d lab;  ///< CIE L*a*b*, D65
};

/// Fits the matrix. @throws Error as fit_colour_matrix
ColourModel calibrate_colour(FlatField field, std::span<const ColourPatch> patches);

/// CIEDE2000 of each patch by a model of all others. Empty for fewer than four patches, or where the others of one
/// don't determine a matrix.
std::vector<double> cross_validate_colour(std::span<const ColourPatch> patches);

/// The mean colour of a picture's part.
struct RegionColour {
  Eigen::Vector3d lab = Eigen::Vector3d::Zero();  ///< CIE L*a*b*, D65
  double trusted_share = 0.0;  ///< of the part, where the white card was seen and the picture isn't at 255
};
/// @param mask CV_8UC1 of the picture's size, not 0: belongs to the part
/// @throws Error for a picture of another size or type than the model's, or a part of which nothing is trusted
RegionColour colour_of(const ColourModel& model, const cv::Mat& picture, const cv::Mat& mask);

/// The mask of a rectangle in pictures of a size. @throws Error for one that doesn't lie within them
cv::Mat rectangle_mask(const cv::Size& size, const cv::Rect& rectangle);

/// The model as bytes (format "touchstone.colour_model", version 1): a line of JSON with sizes, matrix and errors, and
/// the SHA-256 of what follows: the white card (little-endian float32, B G R, row by row) and where it's trusted (a
/// byte a pixel, 0 or 255). Reading gives the same bits. @throws Error if the model is faulty
std::string to_bytes(const ColourModel& model);
/// Reads what to_bytes wrote; `name` stands for the file in messages. @throws Error naming file and field
ColourModel colour_model_from_bytes(std::string_view bytes, const std::string& name);

/// Writes the file whole or not at all.
void save(const ColourModel& model, const std::filesystem::path& path);
/// @throws Error as colour_model_from_bytes, or if the file can't be read
ColourModel load_colour_model(const std::filesystem::path& path);

}  // namespace touchstone::sensors
