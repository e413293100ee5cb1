#pragma once
// GGX microfacets. All directions are unit vectors in the local frame of the normal (+z), pointing away from the
// surface.

#include <Eigen/Core>

namespace touchstone::render {

/// Density of facet normals, D(m) of Walter et al. 2007 (eq. 33): its integral times cos is one.
double ggx_distribution(double cos_m, double alpha);

/// Smith's masking of one direction, G1 (Walter et al. 2007, eq. 34).
double ggx_masking(double cos_direction, double alpha);

/// Masking and shadowing of a pair, height-correlated (Heitz 2014, eq. 99).
double ggx_masking_shadowing(double cos_in, double cos_out, double alpha);

/// A facet normal among those visible from `out`, density G1(out) max(0, out.m) D(m) / out.z, by the spherical-cap
/// construction of Dupuy and Benyoub 2023. @pre out.z > 0
Eigen::Vector3d sample_visible_normal(const Eigen::Vector3d& out, double alpha, double u, double v);

/// Density per solid angle of the direction that `out` is mirrored to at a facet drawn by sample_visible_normal.
double visible_reflection_density(const Eigen::Vector3d& out, const Eigen::Vector3d& in, double alpha);

/// Reflectance function without Fresnel's factor: D G / (4 cos cos), 1/sr; zero if either is below the surface.
double ggx_reflection(const Eigen::Vector3d& out, const Eigen::Vector3d& in, double alpha);

/// Schlick's (1 - cos)^5, the weight of white in R = R0 + (1 - R0) weight.
double schlick_weight(double cos_half);

}  // namespace touchstone::render
