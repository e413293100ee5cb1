#include "sim/sensor/key_frames.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "render/cameras/first_hits.h"

namespace touchstone::sim {
namespace {

// Centroids of beads are measured to some hundredths of a pixel, far less than what one pixel's noise lets pass.
constexpr double kStill_px = 0.02;
// How much wider than its radius a ball can look, seen askew and through the gel.
constexpr double kWidest = 1.25;

/// A disc whose sum is 1.
cv::Mat disc(int radius) {
  cv::Mat kernel = cv::Mat::zeros(2 * radius + 1, 2 * radius + 1, CV_32F);
  cv::circle(kernel, {radius, radius}, radius, cv::Scalar(1.0), cv::FILLED);
  return kernel / cv::sum(kernel)[0];
}

/// Sets what lies within `radius` pixels of a set pixel.
void widen(cv::Mat& mask, int radius) {
  constexpr int kLargeRadius = 16;  // a lens out of focus; dilation's time grows with the square of the radius
  if (radius <= kLargeRadius) {
    cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}));
    return;
  }
  if (cv::countNonZero(mask) == 0) return;
  cv::Mat distance;
  cv::distanceTransform(mask == 0, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  mask = (distance <= radius);
}

}  // namespace

FrameAppearance appearance_of(const render::Scene& scene, const render::Tracer& tracer,
                              const render::ReadyCamera& camera, const render::Camera& viewer) {
  FrameAppearance appearance;
  appearance.preview = tracer.preview(viewer, kPreviewStride);
  for (const render::Ball& ball : scene.balls) {
    const auto appears = [&](const Eigen::Vector3d& point) {
      return render::project_through_faces(scene, camera, point);
    };
    const std::optional<Eigen::Vector2d> centre = appears(ball.centre);
    double radius_px = 0.0;
    for (int axis = 0; axis < 2 && centre; ++axis) {
      const auto rim = appears(ball.centre + ball.radius * Eigen::Vector3d::Unit(axis));
      if (rim) radius_px = std::max(radius_px, kWidest * (*rim - *centre).norm());
    }
    appearance.balls_px.push_back(centre);
    appearance.radii_px.push_back(radius_px);
  }
  return appearance;
}

ChangeFinder::ChangeFinder(const render::ImagerResponse& response, const render::NoiseTarget& target, double tolerance,
                           PointBlur blur, cv::Size size)
    : response_(response),
      electrons_per_irradiance_(target.electrons_per_irradiance),
      tolerance_(tolerance),
      blur_(blur),
      size_(size) {
  TS_ASSERT(blur.least_px >= 0.0 && blur.most_px >= blur.least_px);
}

cv::Mat ChangeFinder::changed(const FrameAppearance& before, const FrameAppearance& now) const {
  TS_ASSERT(before.preview.size() == now.preview.size() && before.balls_px.size() == now.balls_px.size());
  cv::Mat mask(now.preview.size(), CV_8U, cv::Scalar(0));
  const int bands = static_cast<int>(electrons_per_irradiance_.size());
  // What all points' images are blurred by, the pixels see blurred, too.
  const int least = static_cast<int>(blur_.least_px / kPreviewStride);
  cv::Mat change = now.preview - before.preview;
  cv::Mat level = before.preview;
  if (least > 0) {
    const cv::Mat kernel = disc(least);
    cv::filter2D(change, change, -1, kernel, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    cv::filter2D(level, level, -1, kernel, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
  }
  for (int row = 0; row < mask.rows; ++row) {
    const auto* by = change.ptr<float>(row);
    const auto* was = level.ptr<float>(row);
    auto* out = mask.ptr<unsigned char>(row);
    for (int column = 0; column < mask.cols; ++column) {
      double electrons = 0.0;
      double changed_e = 0.0;
      for (int band = 0; band < bands; ++band) {
        const int at = bands * column + band;
        electrons += electrons_per_irradiance_[band] * was[at];
        changed_e += std::abs(electrons_per_irradiance_[band] * by[at]);
      }
      if (changed_e > tolerance_ * render::noise_e(response_, electrons)) out[column] = 255;
    }
  }
  widen(mask, 1 + static_cast<int>(std::ceil((blur_.most_px - least * kPreviewStride) / kPreviewStride)));
  cv::Mat whole;
  cv::resize(mask, whole, {mask.cols * kPreviewStride, mask.rows * kPreviewStride}, 0, 0, cv::INTER_NEAREST);
  whole = whole(cv::Rect({0, 0}, size_)).clone();
  for (std::size_t i = 0; i < now.balls_px.size(); ++i) {
    const auto &was = before.balls_px[i], &is = now.balls_px[i];
    if (was && is && (*is - *was).norm() < kStill_px) continue;
    const auto draw = [&](const std::optional<Eigen::Vector2d>& centre, double radius_px) {
      if (!centre) return;
      const Eigen::Vector2d nearest = centre->cwiseMax(-1e6).cwiseMin(1e6);
      cv::circle(whole, {static_cast<int>(nearest.x()), static_cast<int>(nearest.y())},
                 static_cast<int>(std::min(std::ceil(radius_px + blur_.most_px) + 1.0, 1e6)), cv::Scalar(255),
                 cv::FILLED);
    };
    draw(was, before.radii_px[i]);
    draw(is, now.radii_px[i]);
  }
  return whole;
}

KnownLight known_light(std::span<const KeyFrame* const> keys, std::span<const FrameAppearance> appearances,
                       const ChangeFinder& finder, cv::Size size, int bands) {
  KnownLight known{cv::Mat(size, CV_32FC(bands), cv::Scalar::all(0.0)), cv::Mat(size, CV_32FC1, cv::Scalar(0.0)),
                   cv::Mat(size, CV_8U, cv::Scalar(255))};
  for (const KeyFrame* key : keys) {
    cv::Mat changed(size, CV_8U, cv::Scalar(0));
    for (const FrameAppearance& appearance : appearances) changed |= finder.changed(key->appearance, appearance);
    const cv::Mat takes = known.missing(key->where) & ~changed(key->where);
    key->irradiance.copyTo(known.irradiance(key->where), takes);
    key->standard_error.copyTo(known.standard_error(key->where), takes);
    known.missing(key->where).setTo(0, takes);
  }
  return known;
}

void add_traced(const cv::Mat& irradiance, const cv::Mat& standard_error, KnownLight& light) {
  irradiance.copyTo(light.irradiance, light.missing);
  standard_error.copyTo(light.standard_error, light.missing);
}

}  // namespace touchstone::sim
