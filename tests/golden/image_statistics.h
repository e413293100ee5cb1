#pragma once
// A picture as mean and variance, and whether two of them can be of the same scene.
//
// The test is that of Mitsuba 3's render tests [Jakob2022]: a z-test in each pixel and band, and Sidak's correction
// [Sidak1967] for how many there are. Here the variance of the reference counts, too; that of the test picture, known
// from few batches only, is its own or what the reference's paths make expected, whichever is more, and its statistic
// is Student's t; and besides pixels the means of 8 x 8 blocks and of the whole picture are tested, which see a bias
// that drowns in the noise of one pixel.

#include <array>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "render/paths/path_tracer.h"

namespace touchstone::golden {

/// CV_32FC(bands) both, W/m^2 and its square: the mean of `batches` renderings, and the variance of that mean.
struct ImageStatistics {
  cv::Mat mean;
  cv::Mat variance;
  int batches = 0;
  std::int64_t paths = 0;  ///< a pixel, in all batches
};

/// Renders with the seeds first_seed, first_seed + 1 ... and `samples` paths a pixel each. @pre batches >= 2
ImageStatistics render_batches(const render::Scene& scene, const render::Camera& camera, int batches, int samples,
                               std::uint64_t first_seed);

/// What one level of the test says. `p_value` is the smallest one of all means, `needed` what it must reach.
struct LevelResult {
  std::string name;
  double p_value = 1.0;
  double needed = 0.0;
  double largest_z = 0.0;  ///< of the mean with that p-value, with its sign: test less reference
  bool passes() const { return p_value >= needed; }
};

struct Comparison {
  std::array<LevelResult, 3> levels;  ///< pixels, blocks, picture
  cv::Mat p_values;                   ///< CV_32FC(bands), of the pixels
  double relative_change = 0.0;       ///< of the whole picture's mean over all bands
  bool passes() const;
  std::string text() const;  ///< one line
};

/// `significance` is the chance that a level fails although nothing has changed.
/// @throws Error if the two differ in size or bands
Comparison compare(const ImageStatistics& reference, const ImageStatistics& test, double significance = 1e-3);

/// Writes both as an EXR (channels mean.0, mean.1 ..., variance.0 ...), which git can hold: means are rounded to 10
/// bits, variances to 3; what the rounding adds to the variance is counted by `compare`.
void write_statistics(const std::filesystem::path& file, const ImageStatistics& statistics);
/// @throws Error naming the file
ImageStatistics read_statistics(const std::filesystem::path& file);

/// To look at: three of the bands as red, green and blue, the 99th percentile white, gamma 2.2.
cv::Mat picture_of(const cv::Mat& mean);

}  // namespace touchstone::golden
