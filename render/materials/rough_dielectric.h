#pragma once
// A rough boundary of two clear media: frosted glass, gel cast on a sanded mould, a matt acrylic plate.
//
//   scene.surfaces.push_back({face, RoughRefractive{gel, air, 0.2}});     // outward normal points to air
//
// The boundary is made of small smooth facets whose normals follow GGX of width `roughness` (alpha, as for
// RoughConductor); each mirrors and refracts by Fresnel's equations [Walter2007]. Light that one facet sends to
// another, up to half of it at alpha 1, is given back in a wide lobe on both sides (RoughBoundary), so that a clear
// body under an even sky looks like the sky. Where the two indices are equal light goes straight on.
//
// It scatters, so it counts as a reflection for RenderSettings::max_depth, and lamps light it from both sides; what
// lies behind it is lit by way of it, not by connections to lamps: of those it is a shadow caster, as light doesn't
// come through it from the lamp's direction alone.
//
// The functions take unit vectors in the frame of the macroscopic normal, +z on the side of `out` (where the light goes
// to, the viewer); index `n_out` is that side's, `n_in` that of the other side.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "render/materials/fresnel.h"
#include "render/materials/ggx.h"
#include "render/sampling/sample_sequence.h"

namespace touchstone::render {

/// Media are indices into Scene::media, as in Refractive; `roughness` from 1e-3 to 1.
struct RoughRefractive {
  int medium_inside = 0;
  int medium_outside = 0;
  double roughness = 0.1;
};

/// Scattering function in 1/sr, of light that meets one facet only and comes from `in`: above the surface it is
/// mirrored (eq. 20), below it is refracted (eq. 21, with the n_out^2 that radiance gains; masking of the two sides
/// independent of each other).
inline double rough_dielectric(const Eigen::Vector3d& out, const Eigen::Vector3d& in, double alpha, double n_out,
                               double n_in) {
  if (!(out.z() > 0.0)) return 0.0;
  if (in.z() > 0.0) {
    const double cosine = (out + in).normalized().dot(out);
    return fresnel(n_out, n_in, cosine).mean_reflectance() * ggx_reflection(out, in, alpha);
  }
  if (!(in.z() < 0.0)) return 0.0;
  Eigen::Vector3d facet = -(n_out * out + n_in * in);
  const double length = facet.norm();
  if (!(length > 0.0)) return 0.0;
  facet *= std::copysign(1.0 / length, facet.z());
  const double out_m = out.dot(facet);
  const double in_m = in.dot(facet);
  if (!(out_m > 0.0 && in_m < 0.0)) return 0.0;
  const double passed = 1.0 - fresnel(n_out, n_in, out_m).mean_reflectance();
  const double bend = n_in * in_m + n_out * out_m;
  const double masking = ggx_masking(out.z(), alpha) * ggx_masking(-in.z(), alpha);
  return passed * masking * ggx_distribution(facet.z(), alpha) * out_m * -in_m * n_out * n_out /
         (out.z() * -in.z() * bend * bend);
}

/// A direction that light comes from, drawn close to rough_dielectric's share of the light seen along `out`.
struct RoughSample {
  Eigen::Vector3d in;
  double weight = 0.0;  ///< on basic radiance, L / n^2; 0 to 1: the chance that no other facet stands in the way
};
/// `out` is a unit vector in the boundary's own frame, z its normal on this side, with the index `n_out`; u, v and w
/// are random numbers from 0 to 1.
inline RoughSample sample_rough_dielectric(const Eigen::Vector3d& out, double alpha, double n_out, double n_in,
                                           double u, double v, double w) {
  if (!(out.z() > 0.0)) return {out, 0.0};
  const Eigen::Vector3d facet = sample_visible_normal(out, alpha, u, v);
  const double cosine = std::min(1.0, out.dot(facet));
  if (!(cosine > 0.0)) return {out, 0.0};
  const FresnelFace face = fresnel(n_out, n_in, cosine);
  RoughSample sample;
  if (w < face.mean_reflectance()) {
    sample.in = 2.0 * cosine * facet - out;
    sample.weight = ggx_masking_shadowing(sample.in.z(), out.z(), alpha) / ggx_masking(out.z(), alpha);
  } else {
    const double eta = n_out / n_in;
    sample.in = ((eta * cosine - face.cos_refracted) * facet - eta * out).normalized();
    sample.weight = ggx_masking(-sample.in.z(), alpha);
  }
  return sample;
}

/// A rough boundary that loses nothing: rough_dielectric and a lobe of light that has met several facets.
///
/// With E(x) the share of the light seen along x that one facet explains, x any direction of either side, the lobe adds
///   f(x, y) = n_x^2 (1 - E(x)) (1 - E(y)) / M,   M = the integral of n^2 (1 - E) |cos| over both hemispheres,
/// Kulla and Conty's compensation [Kulla2017] taken over both sides at once: light that has met many facets is taken to
/// have forgotten where it came from. Energy and reciprocity hold exactly; what is lost is the true shape of that
/// light, which is less wide, and its share of either side.
///
/// E is tabulated, to some 3e-3. Sampling doesn't need it: a direction drawn for one facet is kept with its
/// weight's probability, which is E on average, and the rest is drawn from the lobe. So each sample weighs one.
class RoughBoundary {
 public:
  RoughBoundary() = default;
  /// Tabulates E for both sides.
  RoughBoundary(double alpha, double n_outside, double n_inside);

  /// Scattering function in 1/sr; `inside` says on which side `out` is. Vectors as for rough_dielectric.
  double operator()(const Eigen::Vector3d& out, const Eigen::Vector3d& in, bool inside) const;

  /// A direction that light comes from, its density per solid angle the function times |cos| n_in^2 / n_out^2; nothing
  /// where `out` is below the surface.
  std::optional<Eigen::Vector3d> sample(const Eigen::Vector3d& out, bool inside, SampleSequence& numbers) const;

  /// 1 - E at a cosine in [0, 1] on one side.
  double missing(double cosine, bool inside) const;

 private:
  static constexpr int kCells = 32;  // between cosines (k / 32)^2

  Eigen::Vector3d sample_lobe(bool inside, SampleSequence& numbers) const;

  double alpha_ = 0.0;
  std::array<double, 2> index_ = {1.0, 1.0};                 // outside, inside
  std::array<std::array<double, kCells + 1>, 2> missing_{};  // likewise
  std::array<double, 2 * kCells> up_to_{};                   // M's sum over the outside's cells, then the inside's
};

}  // namespace touchstone::render
