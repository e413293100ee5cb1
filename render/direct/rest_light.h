#pragma once
// Bounced light of a fixture at rest, carried along to what is pressed into it.

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "render/direct/direct_renderer.h"

namespace touchstone::render {

/// How many paths the light at rest is traced with, and how it is smoothed.
struct RestLightSettings {
  int samples = 64;        ///< paths a pixel, at most
  int paths = 20000;       ///< that each pixel's value is the mean of, smoothing counted: more than this aren't traced
  int max_depth = 16;      ///< RenderSettings::max_depth
  double smooth_mm = 0.5;  ///< standard deviation on the surface that the result is smoothed with, 0 to 1e3
  std::uint64_t seed = 0;
};

/// The irradiance (W/m^2 in each band) that, coming from everywhere onto what each pixel shows, would add to the direct
/// picture of `rest` what path tracing adds: CV_32FC(bands) of the camera's size, for
/// DirectRenderer::set_bounced_light.
///
/// Light that has bounced comes from the whole neighbourhood, so where a membrane is pressed it changes less than
/// direct light does: what is carried is therefore a sum, not a ratio, which would take bounced light away in a shadow.
/// What changes it most is that the flanks of a dent see the sheet round it. A facet tilted by t against an endless
/// plane sees it under the form factor (1 - cos t) / 2 (Nusselt's projection: a half disc less a half ellipse), so with
/// the scene at rest given to set_bounced_light a matt sheet that has been tilted by t gets
///   (1 + cos t) / 2 times the light at rest + (1 - cos t) / 2 times what the same place sent back at rest.
/// Left out is that a facet faces a brighter or darker side, and what a level place sees of flanks beside it.
/// measure_direct_error (direct_error.h) tells how much that is.
///
/// `traced` is trace_rest()'s answer.
///
/// Noise of the path tracer is smoothed away with the response of the picture to a unit irradiance as weight, so that
/// beads and printless edges don't smear.
/// @throws Error as DirectRenderer::render, or if a setting is out of range
cv::Mat measure_rest_light(DirectRenderer& renderer, const Scene& rest, const Camera& camera, const cv::Mat& traced,
                           const RestLightSettings& settings = {});
/// The same, tracing by itself. @throws Error also as Tracer
cv::Mat measure_rest_light(DirectRenderer& renderer, const Scene& rest, const Camera& camera,
                           const RestLightSettings& settings = {});

/// `rest` by paths, with interreflection: the same for all renderers. @throws Error as measure_rest_light
cv::Mat trace_rest(const Scene& rest, const Camera& camera, const RestLightSettings& settings = {});

/// Paths a pixel that it takes, with the same arguments.
int rest_light_samples(const Scene& rest, const Camera& camera, const RestLightSettings& settings = {});

}  // namespace touchstone::render
