#pragma once
// Material recognition by touch: the nearest of known texture features [Li2015, sec. 5.3].

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "sensors/texture/texture_feature.h"

namespace touchstone::sensors {

inline constexpr int kMostTextureClasses = 65535;  ///< more are refused

/// Features of known materials, and how they were made.
struct TextureModel {
  /// A row for each sample.
  using Features = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  TextureOperator op;
  double gray_step_mm = 0.002;       ///< height of a gray level, see height_gray()
  double mm_per_px = 0.0;            ///< of the images; 0: not known, any image is taken
  std::vector<std::string> classes;  ///< names, each once
  Features features;                 ///< a sample a row
  std::vector<int> labels;           ///< a sample's index in `classes`
};

/// What is wrong with a model (sizes, a label or number out of range, a feature whose length isn't 1), or nothing.
std::string fault_of(const TextureModel& model);

/// Adds a sample of the material `name`, which is a new class if it isn't known yet.
/// @throws Error as texture_feature() and height_gray() do, or for an empty name
void learn_texture(TextureModel& model, const std::string& name, const cv::Mat& heights_mm);

/// The answer for one touch.
struct TextureMatch {
  int label = 0;          ///< index in TextureModel::classes
  int votes = 1;          ///< of the three nearest samples, how many are of this class
  double distance = 0.0;  ///< Hellinger, 0 to 1, to the nearest sample at all: a large one means an unknown material
};

/// The class of at least two of the three nearest samples, else (or with fewer than three samples) that of the nearest
/// one. Of samples at the same distance the first in the model is the nearer one.
/// @throws Error if the model has no sample, or the feature's size isn't the model's
TextureMatch classify(const TextureModel& model, const Eigen::VectorXf& feature);

/// The same for a height image, CV_32FC1, mm.
/// @param mm_per_px of the image; the model's, within 2 %, where both are known (above 0): the operator isn't invariant
///   to scale
/// @throws Error for another pitch, and as height_gray() and texture_feature() do
TextureMatch classify_texture(const TextureModel& model, const cv::Mat& heights_mm, double mm_per_px);

}  // namespace touchstone::sensors
