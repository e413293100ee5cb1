#pragma once
// Material recognition with a GelSight [Li2015, sec. 5.3.2], [Li2013]. Each of 40 surfaces is pressed six times, turned
// at random; each height image gives four samples; some samples of each class train the classifier, the others test it.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/progress.h"
#include "fem/contact/press.h"
#include "sensors/heights/height_model.h"
#include "sensors/texture/texture_model.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {

/// The texture objects of a scenes folder, sorted by name. @throws Error if there is none
std::vector<sim::ObjectSpec> texture_objects(const std::filesystem::path& scenes);

/// The same kind of surface, another piece of it. @throws Error for an object whose relief isn't a random one
sim::ObjectSpec another_patch(const sim::ObjectSpec& object, std::uint64_t seed);

/// How each surface is pressed.
struct TexturePresses {
  int images = 6;             ///< of each class
  double force_N = 8.0;       ///< mean: some 30 kPa under the disc, a firm touch by hand
  double force_spread = 0.1;  ///< relative standard deviation
  double shift_mm = 0.3;      ///< standard deviation of the place, along each axis
  std::uint64_t seed = 1;
};

/// The height images (CV_32FC1, mm) of one press: what the sensor makes of it, and the membrane as it is.
struct PressedHeights {
  cv::Mat estimated, membrane;
};

/// The height images of a pressed object, at least the view; `number` is the press's own. Called from many threads, a
/// pure function.
using HeightsOf = std::function<PressedHeights(const sim::TouchObject&, const fem::PressState&, int number)>;

/// Pixels a side of the middle of the picture that samples are cut from: four squares of 200 px.
inline constexpr int kTextureView_px = 400;

/// A height model of the view's pixels alone, where light is good: from a ball of 2 mm pressed in at 3 x 3 places, its
/// circle found in the frames, as a user would calibrate. @throws Error as sensors::calibrate_height
sensors::HeightModel calibrate_view(const sim::VirtualSensor& sensor, std::uint64_t noise_seed);

/// Heights of the view as the sensor gives them: from the camera's frame, by a model of calibrate_view. The sensor must
/// outlive it. @throws Error if the model can't be used
HeightsOf estimated_heights(const sim::VirtualSensor& sensor, const sensors::HeightModel& model,
                            std::uint64_t noise_seed);

/// The height images of press number `image` on class number `texture`: a new piece of the surface, at a random angle,
/// place and force, all chosen by (seed, texture, image).
PressedHeights press_texture(const sim::VirtualSensor& sensor, const sim::ObjectSpec& object,
                             const TexturePresses& presses, int texture, int image, const HeightsOf& heights_of);

/// Four squares of `side` px about the image's middle, which don't overlap. @throws Error for a smaller image
std::vector<cv::Mat> middle_squares(const cv::Mat& image, int side);

/// One square of a pressed image.
struct TextureSample {
  int texture = 0;
  int image = 0;
  cv::Mat heights;  ///< CV_32FC1, mm
};

/// The same squares twice, so that what the estimator of heights loses can be separated from what surfaces have in
/// common.
struct TextureSamples {
  std::vector<TextureSample> estimated, membrane;
};

/// All samples of `objects`, by class, then image, then square; presses run in parallel.
TextureSamples texture_samples(const sim::VirtualSensor& sensor, const std::vector<sim::ObjectSpec>& objects,
                               const TexturePresses& presses, const HeightsOf& heights_of,
                               const Progress& progress = {});

/// How samples are divided into those that train and those that test.
enum class TextureSplit {
  by_sample,  ///< as in the thesis: squares of one image may stand on both sides
  by_image,   ///< stricter: all squares of an image stand on the same side
};

/// How often the material is right.
struct TextureScore {
  double percent = 0.0;            ///< of the test samples right, mean over the splits
  double standard_error = 0.0;     ///< of that mean, from the splits' scatter
  double worst = 0.0, best = 0.0;  ///< percent of a single split
  Eigen::MatrixXi confusion;       ///< row: true class, column: answer; summed over the splits
};

/// Trains and tests on `splits` random divisions with `training` samples of each class in training.
/// @throws Error if a class hasn't more samples than that, or (by_image) images don't make up that number
TextureScore score_textures(const std::vector<TextureSample>& samples, const sensors::TextureOperator& op,
                            double gray_step_mm, int training, TextureSplit split, int splits, std::uint64_t seed);

/// The pairs of classes that are taken for each other most, "a for b: 12", the most frequent first.
std::vector<std::string> worst_confusions(const Eigen::MatrixXi& confusion, const std::vector<std::string>& names,
                                          std::size_t most);

}  // namespace touchstone::lab
