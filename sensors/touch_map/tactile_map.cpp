#include "sensors/touch_map/tactile_map.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr float kLeastWeight = 0.01F;  // of a pixel at the touch's very border

/// Pixels that a touch covers on the map: columns and rows, the last ones included.
struct Box {
  int left, top, right, bottom;
};

Box covered(const PixelFrame& map, const cv::Size& size, const PixelFrame& touch, const PlanarPose& map_from_touch) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const double u : {0.0, size.width - 1.0}) {
    for (const double v : {0.0, size.height - 1.0}) {
      const Eigen::Vector2d pixel = map.pixel_of(map_from_touch * touch.point_of({u, v}));
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
  }
  return {static_cast<int>(std::floor(low.x())), static_cast<int>(std::floor(low.y())),
          static_cast<int>(std::ceil(high.x())), static_cast<int>(std::ceil(high.y()))};
}

/// Weight of each pixel in averages: 1 inside, falling towards the border of what was touched and of the image.
cv::Mat blend_weights(const cv::Mat& support, double blend_px) {
  cv::Mat framed, distance;
  cv::copyMakeBorder(support, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::distanceTransform(framed, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat weights = distance(cv::Rect(1, 1, support.cols, support.rows)).clone();
  for (int v = 0; v < weights.rows; ++v) {
    for (int u = 0; u < weights.cols; ++u) {
      float& weight = weights.at<float>(v, u);
      if (weight <= 0.0F) continue;
      weight = blend_px > 0.0 ? std::clamp(static_cast<float>(weight / blend_px), kLeastWeight, 1.0F) : 1.0F;
    }
  }
  return weights;
}

}  // namespace

void check(const TactileMapData& data) {
  const cv::Size size = data.height_mm.size();
  if (data.touches < 1) fail("the map is of {} touches; at least 1 is needed", data.touches);
  if (data.height_mm.empty() || data.height_mm.type() != CV_32FC1 || data.weight.type() != CV_32FC1 ||
      data.weight.size() != size) {
    fail("the map's heights and weights must be images of 32 bit floats (CV_32FC1) of one size");
  }
  if (std::max(size.width, size.height) > TactileMap::kMostPixelsASide) {
    fail("the map is {} x {} pixels; at most {} a side are allowed", size.width, size.height,
         TactileMap::kMostPixelsASide);
  }
  if (!(data.frame.mm_per_px > 0.0) || !std::isfinite(data.frame.mm_per_px) || !data.frame.origin_px.allFinite()) {
    fail("the map has {} mm a pixel and its origin at pixel ({}, {}); they must be finite, and the pitch above 0",
         data.frame.mm_per_px, data.frame.origin_px.x(), data.frame.origin_px.y());
  }
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const float height = data.height_mm.at<float>(v, u), weight = data.weight.at<float>(v, u);
      if (!std::isfinite(height) || !std::isfinite(weight) || weight < 0.0F) {
        fail("the map's pixel ({}, {}) has height {} and weight {}; both must be finite, and the weight at least 0", u,
             v, height, weight);
      }
    }
  }
}

TactileMap::TactileMap(const TactileMapSettings& settings)
    : settings_(settings), detector_(settings.registration.features) {
  if (!(settings.blend_mm >= 0.0) || !std::isfinite(settings.blend_mm)) {
    fail("the map's blend_mm is {}; it must be at least 0", settings.blend_mm);
  }
}

TactileMap::TactileMap(TactileMapData data, const TactileMapSettings& settings) : TactileMap(settings) {
  check(data);
  data_ = std::move(data);
  describe();
}

DescribedSurface TactileMap::described(const TouchImage& touch) const {
  DescribedSurface surface;
  surface.detail = relief_detail(touch, settings_.registration.detail);
  surface.features = detector_.detect(surface.detail);
  return surface;
}

void TactileMap::describe() {
  const cv::Mat support = data_.weight > 0.0;
  surface_.detail = relief_detail(data_.height_mm, support, data_.frame, settings_.registration.detail);
  surface_.features = detector_.detect(surface_.detail);
}

Registration TactileMap::localise(const TouchImage& touch) const {
  if (empty()) fail("the map is empty: nothing can be localised on it");
  return register_surfaces(described(touch), surface_, settings_.registration);
}

Registration TactileMap::add(const TouchImage& touch) {
  Registration result;
  if (!empty()) {
    result = localise(touch);
    if (!result.localised()) return result;
  } else {
    check(touch);
    if (cv::countNonZero(touch.contact) == 0) return result;
    result.outcome = Outcome::localised;
    result.confidence = result.correlation = result.overlap = 1.0;
    data_.frame = touch_frame(touch.height_mm.size(), touch.mm_per_px);
    data_.height_mm = cv::Mat(touch.height_mm.size(), CV_32FC1, cv::Scalar(0));
    data_.weight = data_.height_mm.clone();
  }
  place(touch, result.to_from_from);
  ++data_.touches;
  describe();
  return result;
}

void TactileMap::place(const TouchImage& touch, const PlanarPose& map_from_touch) {
  const PixelFrame frame = touch_frame(touch.height_mm.size(), touch.mm_per_px);
  const cv::Mat support = support_of(touch, settings_.registration.detail);
  const cv::Mat weights = blend_weights(support, settings_.blend_mm / touch.mm_per_px);

  Box box = covered(data_.frame, touch.height_mm.size(), frame, map_from_touch);
  const int left = std::max(0, -box.left), top = std::max(0, -box.top);
  const int right = std::max(0, box.right - data_.weight.cols + 1);
  const int bottom = std::max(0, box.bottom - data_.weight.rows + 1);
  if (std::max(data_.weight.cols + left + right, data_.weight.rows + top + bottom) > kMostPixelsASide) {
    fail("the map would grow beyond {} pixels a side", kMostPixelsASide);
  }
  for (cv::Mat* image : {&data_.height_mm, &data_.weight}) {
    cv::copyMakeBorder(*image, *image, top, bottom, left, right, cv::BORDER_CONSTANT, 0);
  }
  data_.frame.origin_px += Eigen::Vector2d(left, top);
  box = {box.left + left, box.top + top, box.right + left, box.bottom + top};

  // What the touch says of each pixel of the map. Heights between a supported pixel and one that isn't are left out.
  const PlanarPose touch_from_map = map_from_touch.inverse();
  struct Found {
    int u, v;
    double height, weight;
  };
  std::vector<Found> found;
  double offset_sum = 0.0, offset_weight = 0.0;
  for (int v = box.top; v <= box.bottom; ++v) {
    for (int u = box.left; u <= box.right; ++u) {
      const Eigen::Vector2d pixel = frame.pixel_of(touch_from_map * data_.frame.point_of({u, v}));
      const int near_u = static_cast<int>(std::lround(pixel.x())), near_v = static_cast<int>(std::lround(pixel.y()));
      const bool inside = near_u >= 0 && near_v >= 0 && near_u < weights.cols && near_v < weights.rows;
      if (!inside || support.at<std::uint8_t>(near_v, near_u) == 0) continue;
      const double weight = weights.at<float>(near_v, near_u);
      const Eigen::Vector2d within(std::clamp(pixel.x(), 0.0, weights.cols - 1.0),
                                   std::clamp(pixel.y(), 0.0, weights.rows - 1.0));
      const double height = bilinear(touch.height_mm, within);
      found.push_back({u, v, height, weight});
      const double both = weight * std::min(data_.weight.at<float>(v, u), 1.0F);
      offset_sum += both * (data_.height_mm.at<float>(v, u) - height);
      offset_weight += both;
    }
  }
  const double offset = settings_.level && offset_weight > 0.0 ? offset_sum / offset_weight : 0.0;
  for (const Found& one : found) {
    float& height = data_.height_mm.at<float>(one.v, one.u);
    float& weight = data_.weight.at<float>(one.v, one.u);
    const double sum = weight + one.weight;
    height = static_cast<float>((weight * height + one.weight * (one.height + offset)) / sum);
    weight = static_cast<float>(sum);
  }
}

}  // namespace touchstone::sensors
