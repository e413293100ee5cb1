#pragma once
// GGX microfacets. All directions are unit vectors in the local frame of the normal (+z), pointing away from the
// surface.

#include <Eigen/Core>
#include <array>

namespace touchstone::render {

/// Density of facet normals, D(m) of [Walter2007, eq. 33]: its integral times cos is one.
double ggx_distribution(double cos_m, double alpha);

/// Smith's masking of one direction, G1 [Walter2007, eq. 34].
double ggx_masking(double cos_direction, double alpha);

/// Masking and shadowing of a pair, height-correlated [Heitz2014, eq. 99].
double ggx_masking_shadowing(double cos_in, double cos_out, double alpha);

/// A facet normal among those visible from `out`, density G1(out) max(0, out.m) D(m) / out.z, by the spherical-cap
/// construction of [Dupuy2023]. @pre out.z > 0
Eigen::Vector3d sample_visible_normal(const Eigen::Vector3d& out, double alpha, double u, double v);

/// Density per solid angle of the direction that `out` is mirrored to at a facet drawn by sample_visible_normal.
double visible_reflection_density(const Eigen::Vector3d& out, const Eigen::Vector3d& in, double alpha);

/// Reflectance function without Fresnel's factor: D G / (4 cos cos), 1/sr; zero if either is below the surface.
double ggx_reflection(const Eigen::Vector3d& out, const Eigen::Vector3d& in, double alpha);

/// What a white surface of single reflections sends back of light from one direction: E(cos) = int ggx_reflection cos
/// d omega, tabulated for one alpha (by 512 quasi-random reflections a node, good to 1e-3). What is missing to one is
/// light that goes from facet to facet: 12 % on average for alpha 0.25, 59 % for 1.
class GgxAlbedo {
 public:
  GgxAlbedo() { table_.fill(1.0); }
  /// Tabulates it for one alpha.
  explicit GgxAlbedo(double alpha);

  /// E at a cosine in [0, 1]; between the nodes a line.
  double operator()(double cosine) const;
  /// Factor on ggx_reflection that gives that light back, coloured by the reflectance at normal incidence once more:
  /// 1 + reflectance * (value) after [Turquin2019].
  double missing_ratio(double cosine) const {
    const double e = (*this)(cosine);
    return (1.0 - e) / e;
  }

 private:
  static constexpr int kNodes = 33;  // at cos = (k / 32)^2
  std::array<double, kNodes> table_;
};

/// Schlick's (1 - cos)^5, the weight of white in R = R0 + (1 - R0) weight [Schlick1994].
double schlick_weight(double cos_half);

}  // namespace touchstone::render
