#include "render/shared_paths.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "render/first_hits.h"

namespace touchstone::render {
namespace {

constexpr int kBlock = 32;  // pixels in which the footprint is the same

/// A block's own pixel of first hits, or the nearest height known.
std::vector<double> heights_of_blocks(const std::vector<FirstHit>& hits, const std::vector<Eigen::Vector2d>& middles,
                                      int width) {
  std::vector<double> heights;
  std::vector<std::size_t> unknown;
  double sum = 0.0;
  for (const Eigen::Vector2d& middle : middles) {
    const FirstHit& hit = hits[static_cast<std::size_t>(middle.y()) * width + static_cast<std::size_t>(middle.x())];
    if (hit.object < 0) unknown.push_back(heights.size());
    heights.push_back(hit.object < 0 ? 0.0 : hit.position.z());
    sum += heights.back();
  }
  const std::size_t known = heights.size() - unknown.size();
  for (const std::size_t block : unknown) heights[block] = known > 0 ? sum / static_cast<double>(known) : 0.0;
  return heights;
}

}  // namespace

SharedPaths::SharedPaths(const Scene& rest, const PinholeCamera& camera, int least_paths) : camera_(camera) {
  TS_ASSERT(least_paths >= 1);
  const std::vector<Eigen::Vector2d> middles = footprint_blocks(camera, kBlock);
  const std::vector<double> heights = heights_of_blocks(first_hits(rest, camera), middles, camera.width);
  const double middle_height = heights[heights.size() / 2];
  int layer = 0;
  for (const FlatFace& face : rest.faces) layer += face.z < middle_height ? 1 : 0;
  footprint_ = make_footprint(rest, camera, layer, heights, kBlock, std::sqrt(4.0 / std::numbers::pi * least_paths));
  weight_ = cv::Mat::zeros(camera.height, camera.width, CV_32FC1);
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      if (const auto ray = pinhole_ray(camera, column + 0.5, row + 0.5, 0.5, 0.5)) {
        weight_.at<float>(row, column) =
            static_cast<float>(ray->weight) * footprint_.gain[footprint_.block_at(row, column)];
      }
    }
  }
}

RenderedImage SharedPaths::render(const Tracer& tracer, const RenderSettings& settings, bool with_error) const {
  RenderedImage image;
  const cv::Mat points = tracer.central_paths(camera_, footprint_.grid, settings, image.counts);
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
  const int side = footprint_.spacing;
  tbb::parallel_for(0, camera_.height, [&](int row) {
    std::vector<float> line(static_cast<std::size_t>(planes) * footprint_.block);
    const auto* weight = weight_.ptr<float>(row);
    auto* out = image.irradiance.ptr<float>(row);
    auto* error = with_error ? image.standard_error.ptr<float>(row) : nullptr;
    for (int left = 0; left < camera_.width; left += footprint_.block) {
      const int right = std::min(camera_.width, left + footprint_.block);
      for (int phase = left; phase < std::min(left + side, right); ++phase) {
        const int pixels = (right - phase + side - 1) / side;
        for (int plane = 0; plane < planes; ++plane) {
          footprint_.spread(by_plane.data() + plane * count, row, phase, pixels,
                            line.data() + static_cast<std::size_t>(plane) * footprint_.block);
        }
        const float share = with_error ? footprint_.sum_of_squares(row, phase) : 0.0f;
        for (int k = 0; k < pixels; ++k) {
          const int column = phase + k * side;
          const auto value = [&](int plane) { return line[static_cast<std::size_t>(plane) * footprint_.block + k]; };
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
