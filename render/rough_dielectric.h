#pragma once
// A rough boundary of two clear media: frosted glass, gel cast on a sanded mould, a matt acrylic plate.
//
//   scene.surfaces.push_back({face, RoughRefractive{gel, air, 0.2}});     // outward normal points to air
//
// The boundary is made of small smooth facets whose normals follow GGX of width `roughness` (alpha, as for
// RoughConductor); each mirrors and refracts by Fresnel's equations (Walter et al. 2007, "Microfacet models for
// refraction through rough surfaces"). Light that a facet sends to another facet is lost at each passage: a clear ball
// of index 1.5 under an even sky, which light passes twice and more, shows 0.9999 of it at alpha 0.01, 0.984 at 0.1,
// 0.86 at 0.3 and 0.68 at 0.5. Where the two indices are equal light goes straight on.
//
// It scatters, so it counts as a reflection for RenderSettings::max_depth, and lamps light it from both sides; what
// lies behind it is lit by way of it, not by connections to lamps: of those it is a shadow caster, as light doesn't
// come through it from the lamp's direction alone.
//
// The functions take unit vectors in the frame of the macroscopic normal, +z on the side of `out` (where the light goes
// to, the viewer); index `n_out` is that side's, `n_in` that of the other side.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "render/fresnel.h"
#include "render/ggx.h"

namespace touchstone::render {

/// Media are indices into Scene::media, as in Refractive; `roughness` from 1e-3 to 1.
struct RoughRefractive {
  int medium_inside = 0;
  int medium_outside = 0;
  double roughness = 0.1;
};

/// Scattering function in 1/sr of light that comes from `in`: above the surface it is mirrored (eq. 20), below it is
/// refracted (eq. 21, with the n_out^2 that radiance gains; masking of the two sides independent of each other).
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
  double weight = 0.0;  ///< on basic radiance, L / n^2; 0 to 1, 0 where the light is lost
};
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

}  // namespace touchstone::render
