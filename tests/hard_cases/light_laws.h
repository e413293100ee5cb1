#pragma once
// What every picture must keep, however hard its scene: finite, no more light than there is, no fireflies, the same
// bytes on any number of threads.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Core>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {

using test::did;
using test::refused;
using test::Worst;

/// What the pixels of a picture see: mean radiance over many renderings, and its standard error. Pixel after pixel, in
/// each the bands.
struct Seen {
  Eigen::ArrayXd mean, error;
  double least() const { return mean.minCoeff(); }
  double most() const { return mean.maxCoeff(); }
  std::string range() const { return fmt::format("{:.5g} to {:.5g}", least(), most()); }
  /// Is the whole picture of this radiance, within the noise?
  bool is(double radiance) const { return ((mean - radiance).abs() <= 5.0 * error + 1e-6 * std::abs(radiance)).all(); }
};

inline std::vector<unsigned char> bytes_of(const cv::Mat& image) {
  return {image.datastart, image.dataend};
}

/// The irradiance of a picture as an array, pixel after pixel.
inline Eigen::ArrayXd values_of(const cv::Mat& image) {
  return Eigen::Map<const Eigen::ArrayXf>(image.ptr<float>(),
                                          static_cast<Eigen::Index>(image.total()) * image.channels())
      .cast<double>();
}

/// How far the one of `values` (a pixel's means of independent renderings) that is farthest from the others lies from
/// their mean, in standard deviations of the others: a t statistic, turned into that of a normal distribution of the
/// same tail [Wallace1959]. Deviations below `floor` are rounding.
inline double farthest(const Eigen::ArrayXd& values, double floor) {
  const auto count = static_cast<double>(values.size());
  const double freedom = count - 2.0;
  double most = 0.0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const double mean = (values.sum() - values[i]) / (count - 1.0);
    const double squares = (values - mean).square().sum() - std::pow(values[i] - mean, 2);
    const double spread = std::max(floor, std::sqrt(squares / freedom * count / (count - 1.0)));
    const double t = std::abs(values[i] - mean) / spread;
    most = std::max(most,
                    std::sqrt(freedom * std::log1p(t * t / freedom)) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0));
  }
  return most;
}

/// Renders the scene with 40 seeds and expects of each picture that it is finite and nowhere negative, of the first one
/// that one and four threads give the same bytes, and of each pixel that none of its 40 means lies beyond 6 standard
/// deviations of the others. A mean of `samples_each` paths must be close to Gaussian, or the last law fails rightly:
/// a pixel whose light comes on one path in a thousand needs thousands.
inline Seen render_checked(const Scene& scene, const Camera& camera, int samples_each = 256, int max_depth = 64) {
  constexpr int kRuns = 40;
  const Tracer tracer(scene);
  // What surroundings of radiance one would give: turns irradiance into radiance, as hole and paths are the same.
  const int bands = static_cast<int>(scene.environment.size());
  Scene sky;
  sky.environment = flat_spectrum(bands, 1.0);
  const Tracer empty(sky);

  Eigen::ArrayXXd seen;
  for (int run = 0; run < kRuns; ++run) {
    RenderSettings settings = samples(samples_each, max_depth);
    settings.seed = static_cast<std::uint64_t>(run) + 100;
    cv::Mat image = tracer.render(camera, settings).irradiance;
    EXPECT_TRUE(cv::checkRange(image, true, nullptr, 0.0, std::numeric_limits<double>::max()));
    if (run == 0) {
      const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
      EXPECT_EQ(bytes_of(image), bytes_of(tracer.render(camera, settings).irradiance)) << "threads";
      seen.resize(image.total() * image.channels(), kRuns);
    }
    seen.col(run) = values_of(image) / values_of(empty.render(camera, settings).irradiance);
  }
  Seen result;
  result.mean = seen.rowwise().mean();
  result.error = ((seen.colwise() - result.mean).square().rowwise().sum() / (kRuns * (kRuns - 1.0))).sqrt();
  const double floor = 1e-6 * std::max(1e-30, result.mean.maxCoeff());
  for (Eigen::Index i = 0; i < seen.rows(); ++i) {
    EXPECT_LT(farthest(seen.row(i), floor), 6.0) << "a firefly in pixel " << i / bands << " of mean " << result.mean[i];
  }
  return result;
}

/// A few large pixels that see some 18 x 14 mm of the gel from below the glass.
inline PinholeCamera few_pixels() {
  return small_camera(6, 4);
}

/// What is said when the scene or camera is refused; fails where it's taken.
template <typename Action>
std::string refusal(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return {};
}
inline std::string refusal_of(const Scene& scene) {
  return refusal([&] { const Tracer tracer(scene); });
}

}  // namespace touchstone::render
