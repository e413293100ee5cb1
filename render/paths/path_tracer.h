#pragma once
// The path tracer: from a scene and a camera to the irradiance on each pixel.

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "render/cameras/camera.h"
#include "render/scene/scene.h"

namespace touchstone::render {

/// A pixel is sampled until its standard error, in electrons, is below `fraction` times the imager's own noise there,
/// sqrt(signal + read_noise_e^2 + quantisation_e^2). The error is judged from the samples themselves. Where no lamp
/// light reached any of the first ones, or all of it all of them, a few probes that look wider tell whether the rim of
/// a shadow is near; there the pixel goes on until a share of 1 / samples of it that it may have missed can't matter.
/// Something else that fills less than about 1 / min_samples of what a pixel sees through hole or lens may still be
/// missed.
struct NoiseTarget {
  Spectrum electrons_per_irradiance;  ///< electrons in a pixel per W/m^2 in each band (exposure, area, efficiency)
  double read_noise_e = 0.0;
  double quantisation_e = 0.0;  ///< standard deviation of rounding to a digital number: step / sqrt(12)
  double fraction = 0.5;
};

/// How many paths a pixel gets, and how long they may be.
struct RenderSettings {
  std::uint64_t seed = 0;
  int min_samples = 16;   ///< paths per pixel before the first look at the error; powers of two sample best
  int max_samples = 256;  ///< with no noise target each pixel gets exactly `min_samples`
  int max_depth = 8;  ///< diffuse or metallic reflections on a path; refractions and scatterings in media don't count
  std::optional<NoiseTarget> noise;
};

/// How many rays were traced. A "ray" is a path's straight leg from event to event, with or without an Embree call.
struct RayCounts {
  std::uint64_t paths = 0;        ///< camera samples
  std::uint64_t primary = 0;      ///< legs before the first diffuse or metallic hit
  std::uint64_t connections = 0;  ///< connections to lamps that were tested for occlusion
  std::uint64_t bounces = 0;      ///< legs after that hit or a scattering in a medium
  std::uint64_t direct = 0;       ///< those of the connections that came from what a path met first
  std::uint64_t direct_lit = 0;   ///< those of them that nothing stood in the way of
  /// Adds up, count by count.
  RayCounts& operator+=(const RayCounts& other);
};

/// `irradiance`: CV_32FC(N), W/m^2 on the sensor in each band, mean over the pixel's area. `standard_error`: CV_32FC1,
/// of the irradiance summed over the bands (infinite below 8 samples), with what may be missed near a shadow's rim.
/// `samples`: CV_32S, paths spent. Pixels outside the mask are zero.
struct RenderedImage {
  cv::Mat irradiance;
  cv::Mat standard_error;
  cv::Mat samples;
  RayCounts counts;
};

/// A scene made ready for tracing. Building it costs a few ms for some thousand triangles, so a deforming scene gets a
/// new one for each frame.
///
/// What is simulated: lamp light on diffuse and metallic surfaces by exact connections through the flat faces
/// (layer_connection.h), bounced light by path tracing with all refractions and internal reflections at faces and
/// Refractive surfaces. Flat faces keep the s and p polarisations apart along a straight chain of faces.
/// Paths carry basic radiance, L / n^2, which is the same on both sides of a face but for Fresnel's loss.
///
/// Diffuse transmitters and rough boundaries are lit by connections on both sides; lamps shine through thin films; in
/// scattering media each scattering is lit by one connection, weakened by absorption and scattering on its path.
///
/// What is biased, and where: a connection from a point *beyond* a Refractive surface (an object that is near the gel
/// but doesn't touch it) treats that surface as flat and horizontal at the height found straight below the point; a
/// connection that passes Refractive surfaces in other ways goes straight through them. Lamp light mirrored by faces or
/// focused by curved surfaces onto matt surfaces (caustics of the lamp) is left out, as is the lamp's own mirror image.
/// A connection from inside a scattering body that Refractive surfaces bound (not flat faces) takes the surface towards
/// the lamp as flat in the same way: right for a membrane, wrong for a lamp at the side of a milky ball.
/// A path after 64 smooth refractions or reflections since its last scattering in a medium is taken to have left the
/// scene. Paths that carry little end by Russian roulette from the third reflection or scattering on.
///
/// A path is a pure function of (seed, pixel, sample), a pixel of (seed, pixel): the same bytes for any number of
/// threads and with any mask.
class Tracer {
 public:
  /// Throws Error if the scene is faulty (check_scene) or has a number of bands that isn't one of kBandCounts.
  explicit Tracer(const Scene& scene);
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  /// Renders the pixels where `mask` (CV_8UC1, the camera's size) isn't zero; an empty mask means all.
  RenderedImage render(const Camera& camera, const RenderSettings& settings, const cv::Mat& mask = {}) const;

  /// A preview without noise, for finding what changed between two scenes: one ray through the hole's or lens's centre
  /// for each block of `stride` x `stride` pixels (at the block's centre), lamps as points, direct light only.
  /// CV_32FC(N) of ceil(height/stride) x ceil(width/stride).
  cv::Mat preview(const Camera& camera, int stride) const;

  /// Paths for each point of `grid`, through the centre of hole or lens, drawn over the square of the grid's spacing
  /// round the point; `paths` (CV_8UC1 of grid.rows x grid.columns; 0 is taken for 1; empty: one each) says how many.
  /// Their mean, CV_32FC(N) of that size: radiance in the camera's medium, W/m^2/sr; 0 where no light passes. Numbers
  /// are stratified over neighbouring points that have as many paths, 16 by 16, so that a mean over them has less noise
  /// than one over as many paths each by itself. Of the settings only `seed` and `max_depth` count. Adds to `counts`.
  cv::Mat central_paths(const Camera& camera, const ImageGrid& grid, const cv::Mat& paths,
                        const RenderSettings& settings, RayCounts& counts) const;

  /// What the paths themselves do, for tests and tools: mean basic radiance seen along a ray of the gel frame.
  Spectrum radiance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                    const RenderSettings& settings) const;

  struct Prepared;  ///< one per number of bands; defined where it's used

 private:
  std::unique_ptr<Prepared> prepared_;
};

}  // namespace touchstone::render
