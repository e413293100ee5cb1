#pragma once
// Frames whose light is kept, for the frames that look like them in parts: only pixels that a moved bead, gel surface
// or object reaches are traced again.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "render/cameras/camera.h"
#include "render/imager/imager.h"
#include "render/paths/path_tracer.h"
#include "render/spectra/spectrum.h"

namespace touchstone::sim {

/// What a frame looks like without noise: enough to find where another one differs.
struct FrameAppearance {
  cv::Mat preview;                                       ///< Tracer::preview, each kPreviewStride-th pixel
  std::vector<std::optional<Eigen::Vector2d>> balls_px;  ///< where the scene's balls (beads) appear, if they do
  std::vector<double> radii_px;                          ///< of the balls there, at most
};

inline constexpr int kPreviewStride = 2;  ///< pixels, along both axes

/// @param tracer of the scene
/// @param camera `viewer` made ready
FrameAppearance appearance_of(const render::Scene& scene, const render::Tracer& tracer,
                              const render::ReadyCamera& camera, const render::Camera& viewer);

/// Light that is kept.
struct KeyFrame {
  std::int64_t t_us = 0;
  FrameAppearance appearance;
  cv::Rect where;          ///< the part of the picture that is kept
  cv::Mat irradiance;      ///< of that part, W/m^2 in each band
  cv::Mat standard_error;  ///< of the irradiance
};

/// Radius of the image of a sharp point, of any point of a scene, pixels.
struct PointBlur {
  double least_px = 0.0;
  double most_px = 0.0;
};

/// Finds what changed between two frames.
class ChangeFinder {
 public:
  /// @param tolerance a change of this part of the imager's noise is none
  ChangeFinder(const render::ImagerResponse& response, const render::NoiseTarget& target, double tolerance,
               PointBlur blur, cv::Size size);

  /// CV_8U, 255 for the pixels that may have changed: those where the preview, as blurred as all points are at least,
  /// differs, with what more blur reaches from there; and those about a ball that moved, however little of its rim the
  /// preview's rays show.
  cv::Mat changed(const FrameAppearance& before, const FrameAppearance& now) const;

 private:
  render::ImagerResponse response_;
  render::Spectrum electrons_per_irradiance_;
  double tolerance_;
  PointBlur blur_;
  cv::Size size_;
};

/// What of a frame is known, and which pixels have to be traced.
struct KnownLight {
  cv::Mat irradiance;      ///< 0 where it isn't known
  cv::Mat standard_error;  ///< likewise
  cv::Mat missing;         ///< CV_8U, 255 or 0
};

/// The light of a frame as far as keys have it; of several keys that have a pixel, the one that comes first.
/// `appearances` are the frame's at one or more moments: a pixel that changed at any of them is missing.
KnownLight known_light(std::span<const KeyFrame* const> keys, std::span<const FrameAppearance> appearances,
                       const ChangeFinder& finder, cv::Size size, int bands);

/// Sets what was missing.
void add_traced(const cv::Mat& irradiance, const cv::Mat& standard_error, KnownLight& light);

}  // namespace touchstone::sim
