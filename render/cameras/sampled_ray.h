#pragma once
// The ray of one of a pixel's samples: through any place of hole or lens, or spread by diffraction.

#include <optional>

#include "render/cameras/camera.h"
#include "render/sampling/sample_sequence.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// A camera ray and what counts beside its weight in each band.
template <int N>
struct SampledRay {
  CameraRay ray;
  Bands<N> bands = Bands<N>::Ones();
};

/// The ratio of the bands' densities to a draw's.
template <int N>
Bands<N> weights_of(const DiffractionSpread& spread, const Eigen::Vector2d& at, const DiffractionSpread::Draw& draw) {
  Bands<N> weights;
  for (int band = 0; band < N; ++band) weights[band] = spread.density(band, at, draw.away) / draw.density;
  return weights;
}

/// The mean over samples of weight, bands and radiance is the irradiance at an image point. With diffraction all light
/// of a hole comes through its centre, from the direction of another image point. nullopt where no light passes. What
/// `numbers` gives next doesn't depend on whether there's diffraction, so pictures with and without share their noise.
template <int N>
std::optional<SampledRay<N>> sampled_ray(const PinholeCamera& camera, double x, double y, SampleSequence& numbers,
                                         SampleSequence&) {
  const auto [u, v] = numbers.next_pair();
  if (!camera.diffraction) {
    const std::optional<CameraRay> ray = pinhole_ray(camera, x, y, u, v);
    if (!ray) return std::nullopt;
    return SampledRay<N>{*ray};
  }
  const std::optional<CameraRay> whole = pinhole_ray(camera, x, y, u, v);
  if (!whole) return std::nullopt;
  const Eigen::Vector2d at = from_axis_mm(camera, x, y);
  const DiffractionSpread::Draw draw = camera.diffraction->draw(u, v);
  const Eigen::Vector2d from = image_point_at(camera, at + draw.away);
  const CameraRay ray{Eigen::Vector3d::Zero(), view_direction(camera, from.x(), from.y()), whole->weight};
  return SampledRay<N>{ray, weights_of<N>(*camera.diffraction, at, draw)};
}

/// The same of a lens: its places are drawn as without diffraction, which spreads the image point by numbers of
/// `other`, by the mean over the bands and the field, so that no weights add noise.
template <int N>
std::optional<SampledRay<N>> sampled_ray(const PreparedLens& camera, double x, double y, SampleSequence& numbers,
                                         SampleSequence& other) {
  const auto [u, v] = numbers.next_pair();
  if (!camera.diffraction) return SampledRay<N>{lens_ray(camera, x, y, u, v)};
  const Eigen::Vector2d at = from_axis_mm(camera, x, y);
  const auto [p, q] = other.next_pair();
  const DiffractionSpread::Draw draw = camera.diffraction->draw(p, q);
  const Eigen::Vector2d from = image_point_at(camera, at + draw.away);
  // Beside the picture the distortion may have no inverse: there the picture is taken to go on as at the point itself.
  const bool known = view_direction(camera, from.x(), from.y()).has_value();
  const CameraRay ray = known ? lens_ray(camera, from.x(), from.y(), u, v) : lens_ray(camera, x, y, u, v);
  return SampledRay<N>{ray};
}

}  // namespace touchstone::render
