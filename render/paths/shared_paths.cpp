#include "render/paths/shared_paths.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/error.h"
#include "render/cameras/first_hits.h"

namespace touchstone::render {
namespace {

constexpr int kBlock = 32;  // pixels in which the footprint is the same
constexpr int kPreviewStride = 4;
constexpr double kEdge = 2.0;  // of the imager's noise: what neighbouring points of the preview may differ by

constexpr int kHitStride = 8;         // pixels from one to the next of the first hits that tell heights
constexpr double kHeightStep = 0.01;  // of the distance: half of it is what the blur may be off by
constexpr int kMostHeights = 16;
constexpr int kMostSpacing = 8;  // pixels

/// First hits of one pixel in kHitStride x kHitStride.
struct CoarseHits {
  int columns, rows;
  std::vector<FirstHit> hits;

  CoarseHits(const Scene& scene, const PinholeCamera& camera) {
    PinholeCamera coarse = camera;
    coarse.width = columns = std::max(1, camera.width / kHitStride);
    coarse.height = rows = std::max(1, camera.height / kHitStride);
    coarse.pixel_pitch_um *= kHitStride;
    hits = first_hits(scene, coarse);
  }
};

double electrons_of(const NoiseTarget& target, const float* light) {
  double electrons = 0.0;
  for (Eigen::Index band = 0; band < target.electrons_per_irradiance.size(); ++band) {
    electrons += target.electrons_per_irradiance[band] * light[band];
  }
  return electrons;
}

/// Of the imager, in electrons, at a pixel's light.
double noise_of(const NoiseTarget& target, const float* light) {
  return std::sqrt(std::max(0.0, electrons_of(target, light)) + target.read_noise_e * target.read_noise_e +
                   target.quantisation_e * target.quantisation_e);
}

struct HeightRange {
  double low = INFINITY, high = -INFINITY;
  void add(const FirstHit& hit) {
    if (hit.object < 0) return;
    low = std::min(low, hit.position.z());
    high = std::max(high, hit.position.z());
  }
  bool known() const { return low <= high; }
};

}  // namespace

SharedPaths::SharedPaths(std::span<const Scene> examples, const PinholeCamera& camera, const RenderSettings& settings)
    : camera_(camera) {
  TS_ASSERT(settings.max_samples >= 1 && !examples.empty());
  HeightRange range;
  for (const Scene& scene : examples) {
    for (const FirstHit& hit : CoarseHits(scene, camera).hits) range.add(hit);
  }
  if (!range.known()) range = {0.0, 0.0};
  const double distance = std::abs(camera.gel_from_camera.translation.z() - 0.5 * (range.low + range.high));
  const bool diffracts = camera.diffraction != nullptr;
  const int steps =
      diffracts
          ? 0
          : std::clamp(static_cast<int>(std::ceil((range.high - range.low) / std::max(1e-6, kHeightStep * distance))),
                       0, kMostHeights - 1);
  int layer = 0;
  for (const FlatFace& face : examples.front().faces) layer += face.z < range.low ? 1 : 0;
  const std::size_t blocks = footprint_blocks(camera, kBlock).size();
  // From the camera's far end on, where the footprint is narrowest.
  int margin = 0;
  const auto add_footprint = [&](double height, std::optional<int> band) {
    footprints_.push_back(make_footprint(examples.front(), camera, layer, std::vector<double>(blocks, height), kBlock,
                                         std::sqrt(4.0 / std::numbers::pi * settings.max_samples),
                                         footprints_.empty() ? kMostSpacing : footprints_.front().spacing, band));
    margin = std::max(margin, footprints_.back().margin);
  };
  for (int i = 0; i <= steps; ++i) {
    heights_.push_back(range.high + (range.low - range.high) * i / std::max(1, steps));
    if (!diffracts) add_footprint(heights_.back(), {});
  }
  for (int band = 0; diffracts && band < camera.diffraction->bands(); ++band) add_footprint(heights_.front(), band);
  for (CameraFootprint& footprint : footprints_) footprint.widen(margin);
  weight_ = cv::Mat::zeros(camera.height, camera.width, CV_32FC1);
  const CameraFootprint& footprint = footprints_[footprints_.size() / 2];
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      if (const auto ray = pinhole_ray(camera, column + 0.5, row + 0.5, 0.5, 0.5)) {
        weight_.at<float>(row, column) =
            static_cast<float>(ray->weight) * footprint.gain[footprint.block_at(row, column)];
      }
    }
  }
  if (!settings.noise) return;
  if (!diffracts) {
    paths_ = paths_called_for(examples.back(), settings);
    return;
  }
  // The scatter within so wide a footprint is what is seen, not noise: the hole's disc tells how many paths it takes,
  // and what is left of their noise is in proportion to the sum of squared weights.
  PinholeCamera plain = camera;
  plain.diffraction.reset();
  const SharedPaths geometric(examples, plain, settings);
  const int row = camera.height / 2;
  const int column = camera.width / 2;
  const double times = footprints_[footprints_.size() / 2].sum_of_squares(row, column) /
                       geometric.footprints_[geometric.footprints_.size() / 2].sum_of_squares(row, column);
  paths_ = std::clamp(static_cast<int>(std::ceil(geometric.paths_ * times)), 1, kMostPaths);
}

/// Noise of neighbours that share it isn't averaged away over them.
int SharedPaths::paths_called_for(const Scene& example, const RenderSettings& settings) const {
  const NoiseTarget& noise = *settings.noise;
  const RenderedImage image = render(example, Tracer(example), settings, true);
  std::vector<double> squares;  // of the error, in units of what is allowed
  squares.reserve(image.standard_error.total());
  const double electrons_per_irradiance = noise.electrons_per_irradiance.mean();
  const std::ptrdiff_t bands = image.irradiance.channels();
  for (int row = 0; row < image.standard_error.rows; ++row) {
    for (int column = 0; column < image.standard_error.cols; ++column) {
      const double allowed =
          kSharedPart * noise.fraction * noise_of(noise, image.irradiance.ptr<float>(row) + bands * column);
      const double error = electrons_per_irradiance * image.standard_error.at<float>(row, column);
      squares.push_back(error * error / (allowed * allowed));
    }
  }
  // Where an edge is seen the scatter isn't noise: the lower quartile is of pixels without one in most pictures.
  const auto quartile = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 4);
  std::nth_element(squares.begin(), quartile, squares.end());
  int paths = 1;
  while (paths < kMostPaths && paths < *quartile) paths *= 2;
  return paths;
}

/// By block: the footprint of the height in the middle of what lies in it or as far beside it as points are spread.
std::vector<std::size_t> SharedPaths::footprints_of_blocks(const Scene& scene) const {
  const CameraFootprint& any = footprints_.front();
  std::vector<std::size_t> chosen(any.gain.size(), heights_.size() / 2);
  if (heights_.size() < 2) return chosen;
  const CoarseHits seen(scene, camera_);
  const int reach = any.margin * any.spacing;
  const double step = (heights_.back() - heights_.front()) / static_cast<double>(heights_.size() - 1);
  for (std::size_t block = 0; block < chosen.size(); ++block) {
    const int left = static_cast<int>(block) % any.blocks_across * kBlock;
    const int top = static_cast<int>(block) / any.blocks_across * kBlock;
    HeightRange range;
    const int last_row = std::min(seen.rows - 1, (top + kBlock + reach) / kHitStride);
    const int last_column = std::min(seen.columns - 1, (left + kBlock + reach) / kHitStride);
    for (int row = std::max(0, top - reach) / kHitStride; row <= last_row; ++row) {
      for (int column = std::max(0, left - reach) / kHitStride; column <= last_column; ++column) {
        range.add(seen.hits[static_cast<std::size_t>(row) * seen.columns + column]);
      }
    }
    if (!range.known()) continue;
    const double place = std::round((0.5 * (range.low + range.high) - heights_.front()) / step);
    chosen[block] = static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(heights_.size() - 1)));
  }
  return chosen;
}

/// More paths where a preview has edges: what changes from point to point makes more noise than what doesn't, and
/// shared noise isn't averaged away between neighbours. The preview has no noise of its own, so that choosing by it
/// favours no light.
cv::Mat SharedPaths::paths_of_points(const Tracer& tracer, const RenderSettings& settings) const {
  const ImageGrid& grid = footprints_.front().grid;
  cv::Mat paths(grid.rows, grid.columns, CV_8UC1, cv::Scalar(paths_));
  if (!settings.noise) return paths;
  const NoiseTarget& noise = *settings.noise;
  const cv::Mat preview = tracer.preview(camera_, kPreviewStride);
  cv::Mat electrons(preview.size(), CV_32FC1);
  const std::ptrdiff_t bands = preview.channels();
  for (int row = 0; row < preview.rows; ++row) {
    for (int column = 0; column < preview.cols; ++column) {
      electrons.at<float>(row, column) =
          static_cast<float>(electrons_of(noise, preview.ptr<float>(row) + bands * column));
    }
  }
  cv::Mat least, most;
  cv::erode(electrons, least, cv::Mat());
  cv::dilate(electrons, most, cv::Mat());
  cv::Mat edges(preview.size(), CV_8UC1, cv::Scalar(0));
  for (int row = 0; row < preview.rows; ++row) {
    for (int column = 0; column < preview.cols; ++column) {
      const double imager_noise = noise_of(noise, preview.ptr<float>(row) + bands * column);
      if (most.at<float>(row, column) - least.at<float>(row, column) > kEdge * imager_noise) {
        edges.at<unsigned char>(row, column) = 1;
      }
    }
  }
  for (int row = 0; row < grid.rows; ++row) {
    const int from_row =
        std::clamp(static_cast<int>((grid.top + row * grid.spacing) / kPreviewStride), 0, edges.rows - 1);
    for (int column = 0; column < grid.columns; ++column) {
      const int from =
          std::clamp(static_cast<int>((grid.left + column * grid.spacing) / kPreviewStride), 0, edges.cols - 1);
      if (edges.at<unsigned char>(from_row, from) != 0) {
        paths.at<unsigned char>(row, column) = static_cast<unsigned char>(kEdgePaths * paths_);
      }
    }
  }
  return paths;
}

RenderedImage SharedPaths::render(const Scene& scene, const Tracer& tracer, const RenderSettings& settings,
                                  bool with_error) const {
  RenderedImage image;
  const cv::Mat paths = paths_of_points(tracer, settings);
  const cv::Mat points = tracer.central_paths(camera_, footprints_.front().grid, paths, settings, image.counts);
  const int bands = points.channels();
  const int planes = bands + (with_error ? 2 : 0);  // and the sum over the bands and its square
  const auto count = static_cast<std::size_t>(points.total());
  std::vector<float> by_plane(count * planes);
  tbb::parallel_for(0, points.rows, [&](int row) {
    const auto* from = points.ptr<float>(row);
    float* to = by_plane.data() + static_cast<std::size_t>(row) * points.cols;
    for (int column = 0; column < points.cols; ++column) {
      float sum = 0.0f;
      for (int band = 0; band < bands; ++band) {
        to[band * count + column] = from[bands * column + band];
        sum += from[bands * column + band];
      }
      if (with_error) {
        to[bands * count + column] = sum;
        to[(bands + 1) * count + column] = sum * sum;
      }
    }
  });
  image.irradiance.create(camera_.height, camera_.width, CV_32FC(bands));
  if (with_error) image.standard_error.create(camera_.height, camera_.width, CV_32FC1);
  const std::vector<std::size_t> chosen = footprints_of_blocks(scene);
  const int side = footprints_.front().spacing;
  tbb::parallel_for(0, camera_.height, [&](int row) {
    std::vector<float> line(static_cast<std::size_t>(planes) * kBlock);
    const auto* weight = weight_.ptr<float>(row);
    auto* out = image.irradiance.ptr<float>(row);
    auto* error = with_error ? image.standard_error.ptr<float>(row) : nullptr;
    for (int left = 0; left < camera_.width; left += kBlock) {
      const CameraFootprint& footprint = footprints_[chosen[footprints_.front().block_at(row, left)]];
      const int right = std::min(camera_.width, left + kBlock);
      for (int phase = left; phase < std::min(left + side, right); ++phase) {
        const int pixels = (right - phase + side - 1) / side;
        for (int plane = 0; plane < planes; ++plane) {
          // The sum over the bands is spread as the middle one is.
          const int band = plane < bands ? plane : bands / 2;
          const CameraFootprint& own = camera_.diffraction ? footprints_[static_cast<std::size_t>(band)] : footprint;
          own.spread(by_plane.data() + plane * count, row, phase, pixels,
                     line.data() + static_cast<std::size_t>(plane) * kBlock);
        }
        const float share = with_error ? footprint.sum_of_squares(row, phase) : 0.0f;
        for (int k = 0; k < pixels; ++k) {
          const int column = phase + k * side;
          const auto value = [&](int plane) { return line[static_cast<std::size_t>(plane) * kBlock + k]; };
          for (int band = 0; band < bands; ++band) out[bands * column + band] = weight[column] * value(band);
          if (!with_error) continue;
          const float variance = std::max(0.0f, value(bands + 1) - value(bands) * value(bands));
          error[column] = weight[column] * std::sqrt(variance * share);
        }
      }
    }
  });
  return image;
}

}  // namespace touchstone::render
