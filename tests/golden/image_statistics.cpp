#include "tests/golden/image_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "core/error.h"
#include "sim/files/image_file.h"

namespace touchstone::golden {
namespace {

constexpr int kBlock = 8;      // pixels a side
constexpr int kMeanBits = 10;  // of a stored mean
constexpr int kVarianceBits = 3;

/// Rounded to so many significant bits.
float rounded(float value, int bits) {
  int exponent = 0;
  const double fraction = std::frexp(static_cast<double>(value), &exponent);
  const double scale = std::ldexp(1.0, bits);
  return static_cast<float>(std::ldexp(std::round(fraction * scale) / scale, exponent));
}

cv::Mat rounded(const cv::Mat& image, int bits) {
  cv::Mat result = image.clone();
  auto* value = result.ptr<float>();
  for (std::size_t i = 0; i < result.total() * result.channels(); ++i) value[i] = rounded(value[i], bits);
  return result;
}

/// A mean over some values of a picture, and how well it's known.
struct Part {
  double difference = 0.0;         // test less reference, summed
  double variance = 0.0;           // of both
  double squared_variances = 0.0;  // sum of the squares of the test's variances

  void add(double is_less_was, double test_variance, double other_variance) {
    difference += is_less_was;
    variance += test_variance + other_variance;
    squared_variances += test_variance * test_variance;
  }

  /// The normal statistic of the same tail as Student's t [Wallace1959], whose degrees of freedom are those of
  /// [Welch1947] and [Satterthwaite1946] with the reference taken as well known.
  double z(int batches) const {
    if (!(variance > 0.0)) return 0.0;
    const double t = difference / std::sqrt(variance);
    if (!(squared_variances > 0.0)) return t;
    const double freedom = (batches - 1) * variance * variance / squared_variances;
    const double z = std::sqrt(freedom * std::log1p(t * t / freedom)) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
    return std::copysign(z, t);
  }
};

/// How far the values of one band lie apart in a pixel and its eight neighbours: what one path over an edge changes.
double contrast(const cv::Mat& image, int row, int column, int band) {
  float low = std::numeric_limits<float>::max();
  float high = std::numeric_limits<float>::lowest();
  for (int i = std::max(0, row - 1); i <= std::min(image.rows - 1, row + 1); ++i) {
    for (int j = std::max(0, column - 1); j <= std::min(image.cols - 1, column + 1); ++j) {
      const float value = image.ptr<float>(i)[j * image.channels() + band];
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  return static_cast<double>(high) - low;
}

double p_value(double z) {
  return std::erfc(std::abs(z) / std::sqrt(2.0));
}

void judge(LevelResult& level, std::size_t count, double significance) {
  level.p_value = p_value(level.largest_z);
  level.needed = -std::expm1(std::log1p(-significance) / static_cast<double>(count));  // Sidak
}

}  // namespace

ImageStatistics render_batches(const render::Scene& scene, const render::Camera& camera, int batches, int samples,
                               std::uint64_t first_seed) {
  TS_ASSERT(batches >= 2);
  const render::Tracer tracer(scene);
  render::RenderSettings settings;
  settings.min_samples = settings.max_samples = samples;
  cv::Mat mean, squares;  // by the recurrence of [Welford1962]
  int bands = 0;
  for (int i = 0; i < batches; ++i) {
    settings.seed = first_seed + static_cast<std::uint64_t>(i);
    cv::Mat image;
    // As one wide band: OpenCV's arithmetic with numbers knows at most four.
    cv::Mat irradiance = tracer.render(camera, settings).irradiance;
    bands = irradiance.channels();
    irradiance.reshape(1).convertTo(image, CV_64F);
    if (i == 0) {
      mean = cv::Mat::zeros(image.size(), image.type());
      squares = mean.clone();
    }
    const cv::Mat off = image - mean;
    mean += off / (i + 1.0);
    squares += off.mul(image - mean);
  }
  ImageStatistics result;
  result.batches = batches;
  result.paths = static_cast<std::int64_t>(batches) * samples;
  mean.convertTo(result.mean, CV_32F);
  squares.convertTo(result.variance, CV_32F, 1.0 / (batches * (batches - 1.0)));
  result.mean = result.mean.reshape(bands);
  result.variance = result.variance.reshape(bands);
  return result;
}

bool Comparison::passes() const {
  return std::all_of(levels.begin(), levels.end(), [](const LevelResult& level) { return level.passes(); });
}

std::string Comparison::text() const {
  std::string line;
  for (const LevelResult& level : levels) {
    line += fmt::format("{}: z {:+.2f}, p {:.2g} (needs {:.1g}){}; ", level.name, level.largest_z, level.p_value,
                        level.needed, level.passes() ? "" : " FAILS");
  }
  return line + fmt::format("mean {:+.3f} %", 100.0 * relative_change);
}

Comparison compare(const ImageStatistics& reference, const ImageStatistics& test, double significance) {
  if (reference.mean.size() != test.mean.size() || reference.mean.type() != test.mean.type()) {
    fail("golden image: {} x {} pixels of {} bands; the stored one has {} x {} of {}", test.mean.cols, test.mean.rows,
         test.mean.channels(), reference.mean.cols, reference.mean.rows, reference.mean.channels());
  }
  const int bands = test.mean.channels();
  const int across = (test.mean.cols + kBlock - 1) / kBlock;
  const int down = (test.mean.rows + kBlock - 1) / kBlock;
  std::vector<Part> blocks(static_cast<std::size_t>(across) * down * bands);
  std::vector<Part> picture(static_cast<std::size_t>(bands));
  Comparison result;
  result.levels[0].name = "pixels";
  result.levels[1].name = "blocks";
  result.levels[2].name = "picture";
  result.p_values.create(test.mean.size(), test.mean.type());
  double light = 0.0;
  double change = 0.0;
  for (const float* value = reference.mean.ptr<float>(); value < reinterpret_cast<const float*>(reference.mean.dataend);
       ++value) {
    light += *value;
  }
  // Less than that is single precision's rounding.
  const double floor = 1e-6 * light / static_cast<double>(reference.mean.total() * bands);
  const auto take = [&](LevelResult& level, const Part& part) {
    const double z = part.z(test.batches);
    if (std::abs(z) > std::abs(level.largest_z)) level.largest_z = z;
    return z;
  };
  for (int row = 0; row < test.mean.rows; ++row) {
    for (int i = 0; i < test.mean.cols * bands; ++i) {
      const double is = test.mean.ptr<float>(row)[i];
      const double was = reference.mean.ptr<float>(row)[i];
      const double was_variance = reference.variance.ptr<float>(row)[i];
      // By luck the test's few batches may agree better than they should; the reference knows how well they should.
      const double is_variance =
          std::max<double>(test.variance.ptr<float>(row)[i],
                           was_variance * (static_cast<double>(reference.paths) / static_cast<double>(test.paths)));
      const double rounding = std::abs(was) * std::ldexp(1.0, -kMeanBits) / std::sqrt(3.0);
      const double other = was_variance + rounding * rounding + floor * floor;
      // Where a few of a pixel's paths pass an edge their number is Poisson's, not Gauss's: two of them are granted.
      const double path = contrast(reference.mean, row, i / bands, i % bands) / static_cast<double>(test.paths);
      const auto band = static_cast<std::size_t>(i % bands);
      const auto block = static_cast<std::size_t>((row / kBlock) * across + i / bands / kBlock);
      Part pixel;
      pixel.add(is - was, is_variance, other + 2.0 * path * path);
      blocks[block * static_cast<std::size_t>(bands) + band].add(is - was, is_variance, other);
      picture[band].add(is - was, is_variance, other);
      change += is - was;
      result.p_values.ptr<float>(row)[i] = static_cast<float>(p_value(take(result.levels[0], pixel)));
    }
  }
  for (const Part& part : blocks) take(result.levels[1], part);
  for (const Part& part : picture) take(result.levels[2], part);
  judge(result.levels[0], test.mean.total() * static_cast<std::size_t>(bands), significance);
  judge(result.levels[1], blocks.size(), significance);
  judge(result.levels[2], picture.size(), significance);
  result.relative_change = light > 0.0 ? change / light : change;
  return result;
}

void write_statistics(const std::filesystem::path& file, const ImageStatistics& statistics) {
  std::vector<cv::Mat> planes, variances;
  cv::split(rounded(statistics.mean, kMeanBits), planes);
  cv::split(rounded(statistics.variance, kVarianceBits), variances);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < planes.size(); ++i) names.push_back(fmt::format("mean.{:02}", i));
  for (std::size_t i = 0; i < variances.size(); ++i) names.push_back(fmt::format("variance.{:02}", i));
  planes.insert(planes.end(), variances.begin(), variances.end());
  cv::Mat image;
  cv::merge(planes, image);
  sim::write_exr(file, image, names,
                 {{"batches", std::to_string(statistics.batches)}, {"paths", std::to_string(statistics.paths)}});
}

ImageStatistics read_statistics(const std::filesystem::path& file) {
  const sim::LinearImage stored = sim::read_exr(file);
  std::vector<cv::Mat> planes, means, variances;
  cv::split(stored.image, planes);
  for (std::size_t i = 0; i < planes.size(); ++i) {  // in the order of their names, which is that of the bands
    (stored.channel_names[i].starts_with("mean.") ? means : variances).push_back(planes[i]);
  }
  if (means.empty() || means.size() != variances.size()) fail("{}: it isn't a golden image", file.string());
  ImageStatistics result;
  cv::merge(means, result.mean);
  cv::merge(variances, result.variance);
  const std::string batches = sim::image_metadata(file, "batches");
  const std::string paths = sim::image_metadata(file, "paths");
  if (batches.empty() || paths.empty()) fail("{}: it doesn't tell its batches and paths", file.string());
  result.batches = std::stoi(batches);
  result.paths = std::stoll(paths);
  return result;
}

cv::Mat picture_of(const cv::Mat& mean) {
  std::vector<cv::Mat> bands;
  cv::split(mean, bands);
  // Three bands run from red to blue, as in our devices; even bands of the visible range from blue to red.
  const std::size_t count = bands.size();
  const std::vector<cv::Mat> shown = count > 3 ? std::vector{bands[count / 5], bands[count / 2], bands[count * 7 / 10]}
                                               : std::vector{bands[count - 1], bands[count / 2], bands[0]};
  cv::Mat picture;
  cv::merge(shown, picture);
  std::vector<float> sorted(picture.ptr<float>(), picture.ptr<float>() + picture.total() * picture.channels());
  const auto white = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 99 / 100);
  std::nth_element(sorted.begin(), white, sorted.end());
  cv::Mat bright;
  cv::pow(picture / std::max(1e-30F, *white), 1.0 / 2.2, bright);
  bright.convertTo(picture, CV_8U, 255.0);
  return picture;
}

}  // namespace touchstone::golden
