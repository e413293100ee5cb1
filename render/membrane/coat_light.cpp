#include "render/membrane/coat_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "render/cameras/first_hits.h"

namespace touchstone::render {
namespace {

constexpr double kUnits = 32000.0;  // of heights as short integers, for the highest coat
constexpr int kRowsAPart = 8;
constexpr float kNowhere = -1e6F;

/// Where each pixel's ray meets the level plane z.
std::vector<FirstHit> plane_hits(const Scene& faces, const ReadyCamera& camera, double z) {
  constexpr double kWide_mm = 1e4;
  Scene scene;
  scene.media = faces.media;
  for (Medium& medium : scene.media) medium = Medium{medium.index};
  scene.faces = faces.faces;
  scene.environment = flat_spectrum(1, 0.0);
  TriangleMesh plane;
  plane.vertices = {
      {-kWide_mm, -kWide_mm, z}, {kWide_mm, -kWide_mm, z}, {kWide_mm, kWide_mm, z}, {-kWide_mm, kWide_mm, z}};
  plane.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.surfaces.push_back({std::move(plane), Black{}});
  return first_hits(scene, camera);
}

}  // namespace

CoatLight::CoatLight(CoatWalks walks, const Scene& faces, const Camera& camera, const Eigen::Vector2d& size_mm,
                     const std::vector<LampArrival>& arrivals, int columns, int rows)
    : walks_(std::move(walks)) {
  const double cell = walks_.cell_mm;
  grid_.spacing_mm = cell;
  grid_.columns = static_cast<int>(std::ceil(size_mm.x() / cell));
  grid_.rows = static_cast<int>(std::ceil(size_mm.y() / cell));
  grid_.left_mm = -0.5 * cell * grid_.columns;
  grid_.top_mm = -0.5 * cell * grid_.rows;
  const ReadyCamera ready = make_ready(camera);
  const Eigen::Vector2i size = size_of(camera);
  camera_ = {size.x(), size.y()};
  const double thickness = walks_.slab.thickness_mm;
  const double inside = 1e-3 * thickness;
  const std::vector<FirstHit> back = plane_hits(faces, ready, -thickness + inside);
  const std::vector<FirstHit> coat = plane_hits(faces, ready, -inside);

  const std::size_t middle = static_cast<std::size_t>(size.y() / 2) * size.x() + size.x() / 2;
  const double pixel = size.x() > 1 ? (back[middle].position - back[middle - 1].position).norm() : cell;
  stride_ = std::max(1, static_cast<int>(std::lround(cell / pixel)));
  looked_ = {(size.x() + stride_ - 1) / stride_, (size.y() + stride_ - 1) / stride_};

  // What each side brings to a place, on the arrivals' own grid.
  std::array<cv::Mat, kLightSides> brought;
  for (cv::Mat& one : brought) one = cv::Mat::zeros(rows, columns, CV_32FC1);
  for (const LampArrival& arrival : arrivals) {
    const int i = std::clamp(static_cast<int>((arrival.place.x() / size_mm.x() + 0.5) * columns), 0, columns - 1);
    const int j = std::clamp(static_cast<int>((arrival.place.y() / size_mm.y() + 0.5) * rows), 0, rows - 1);
    brought[side_of(arrival.direction)].at<float>(j, i) += static_cast<float>(arrival.irradiance);
  }
  cv::Mat place_column(looked_, CV_32FC1), place_row(looked_, CV_32FC1);
  cv::Mat slant_x(looked_, CV_32FC1), slant_y(looked_, CV_32FC1), at_x(looked_, CV_32FC1), at_y(looked_, CV_32FC1);
  for (int j = 0; j < looked_.height; ++j) {
    for (int i = 0; i < looked_.width; ++i) {
      Eigen::Vector3d lower = Eigen::Vector3d::Zero();
      Eigen::Vector3d upper = Eigen::Vector3d::Zero();
      int count = 0;
      for (int y = j * stride_; y < std::min(size.y(), (j + 1) * stride_); ++y) {
        for (int x = i * stride_; x < std::min(size.x(), (i + 1) * stride_); ++x) {
          const std::size_t k = static_cast<std::size_t>(y) * size.x() + x;
          if (back[k].object < 0 || coat[k].object < 0) continue;
          lower += back[k].position;
          upper += coat[k].position;
          ++count;
        }
      }
      if (count == 0) {
        at_x.at<float>(j, i) = at_y.at<float>(j, i) = kNowhere;
        slant_x.at<float>(j, i) = slant_y.at<float>(j, i) = 0.0F;
      } else {
        lower /= count;
        upper /= count;
        const Eigen::Vector2d slant = (upper - lower).head<2>() / (upper - lower).z();
        slant_x.at<float>(j, i) = static_cast<float>(slant.x());
        slant_y.at<float>(j, i) = static_cast<float>(slant.y());
        at_x.at<float>(j, i) = static_cast<float>(lower.x() - inside * slant.x());
        at_y.at<float>(j, i) = static_cast<float>(lower.y() - inside * slant.y());
      }
      place_column.at<float>(j, i) = static_cast<float>((at_x.at<float>(j, i) / size_mm.x() + 0.5) * columns - 0.5);
      place_row.at<float>(j, i) = static_cast<float>((at_y.at<float>(j, i) / size_mm.y() + 0.5) * rows - 0.5);
    }
  }
  std::array<cv::Mat, kLightSides> at_pixel;
  for (int side = 0; side < kLightSides; ++side) {
    cv::remap(brought[side], at_pixel[side], place_column, place_row, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    at_pixel[side] *= walks_.weight[side];
  }
  const double extinction = walks_.slab.absorption_per_mm + walks_.slab.scattering_per_mm;
  for (double depth : walks_.depth_mm) {
    column_.push_back((at_x + depth * slant_x - grid_.left_mm) / cell - 0.5);
    row_.push_back((at_y + depth * slant_y - grid_.top_mm) / cell - 0.5);
    // Along a slanting ray a layer is longer.
    cv::Mat longer = 1.0 + slant_x.mul(slant_x) + slant_y.mul(slant_y);
    cv::sqrt(longer, longer);
    cv::Mat factor;
    cv::exp(-extinction * depth * (longer - 1.0), factor);
    factor = factor.mul(longer);
    std::array<cv::Mat, kLightSides> weight;
    for (int side = 0; side < kLightSides; ++side) weight[side] = at_pixel[side].mul(factor);
    weight_.push_back(std::move(weight));
  }
  rest_ = this->brought(cv::Mat(grid_.rows, grid_.columns, CV_32FC1, cv::Scalar(thickness)));
}

cv::Mat CoatLight::brought(const cv::Mat& thickness) const {
  const double thickest = 2.0 * walks_.slab.thickness_mm;
  const double unit = kUnits / thickest;
  cv::Mat heights;
  thickness.convertTo(heights, CV_16SC1, unit);
  cv::Mat padded;
  cv::copyMakeBorder(heights, padded, walks_.reach, walks_.reach, walks_.reach, walks_.reach, cv::BORDER_REFLECT);
  double least = 0.0;
  cv::minMaxLoc(padded, &least, nullptr);

  // How many walks of a class come from each cell.
  const int classes = static_cast<int>(walks_.depth_mm.size()) * kLightSides;
  std::vector<cv::Mat> counts(classes);
  for (cv::Mat& one : counts) one = cv::Mat::zeros(grid_.rows, grid_.columns, CV_16SC1);
  const int parts = (grid_.rows + kRowsAPart - 1) / kRowsAPart;
  const int columns = grid_.columns;
  tbb::parallel_for(0, parts, [&](int part) {
    const int first = part * kRowsAPart;
    const int end = std::min(grid_.rows, first + kRowsAPart);
    std::vector<short> below(static_cast<std::size_t>(columns));
    for (const CoatWalk& walk : walks_.walks) {
      cv::Mat& count = counts[static_cast<std::size_t>(walk.depth) * kLightSides + walk.side];
      for (int row = first; row < end; ++row) {
        std::fill(below.begin(), below.end(), static_cast<short>(-1));
        for (std::uint32_t k = walk.first; k < walk.first + walk.count; ++k) {
          const CoatCell& cell = walks_.cells[k];
          const auto height = static_cast<short>(unit * cell.height_mm);
          if (height < least) break;  // and so are all that follow
          const short* coat = padded.ptr<short>(row + walks_.reach + cell.dy) + walks_.reach + cell.dx;
          short* to = below.data();
          for (int x = 0; x < columns; ++x) to[x] &= static_cast<short>(coat[x] > height ? -1 : 0);
        }
        auto* sum = count.ptr<short>(row);
        for (int x = 0; x < columns; ++x) sum[x] = static_cast<short>(sum[x] - below[static_cast<std::size_t>(x)]);
      }
    }
  });
  cv::Mat out = cv::Mat::zeros(looked_, CV_32FC1);
  cv::Mat light;
  for (std::size_t depth = 0; depth < walks_.depth_mm.size(); ++depth) {
    for (int side = 0; side < kLightSides; ++side) {
      cv::Mat& count = counts[depth * kLightSides + static_cast<std::size_t>(side)];
      count.convertTo(light, CV_32FC1);
      cv::remap(light, light, column_[depth], row_[depth], cv::INTER_LINEAR, cv::BORDER_REPLICATE);
      out += light.mul(weight_[depth][side]);
    }
  }
  return out;
}

cv::Mat CoatLight::share(const cv::Mat& thickness) const {
  if (thickness.type() != CV_32FC1 || thickness.rows != grid_.rows || thickness.cols != grid_.columns) {
    fail("coated slab: a map of {} x {} cells; the grid has {} x {} (32-bit floats, one channel)", thickness.cols,
         thickness.rows, grid_.columns, grid_.rows);
  }
  cv::Mat kept = brought(thickness);
  cv::divide(kept, rest_, kept);
  // From the looked-at pixels' middles to all.
  const double scale = 1.0 / stride_;
  const cv::Matx23d from_pixel(scale, 0, 0.5 * scale - 0.5, 0, scale, 0.5 * scale - 0.5);
  cv::Mat all;
  cv::warpAffine(kept, all, from_pixel, camera_, cv::INTER_CUBIC | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return all;
}

}  // namespace touchstone::render
