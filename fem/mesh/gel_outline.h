#pragma once
// What domes and fingertips have in common.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fem/mesh/revolved_gel.h"

namespace touchstone::fem {

/// Both kinds of gel: a cap of a sphere with radius `sphere` down to where it is `base` wide, on a cylinder down to
/// -thickness, of which the lowest `sleeve` is bonded at its side. All in mm.
struct Outline {
  const char* name;  ///< in messages
  double sphere, base, thickness, sleeve;
  bool side_outer;  ///< the free part of the side can be touched
  double fine, coarse, fine_radius, fine_depth;
  std::vector<double> layers;

  /// Height of the cap alone.
  double sagitta() const { return base * base / (sphere + std::sqrt(std::max(0.0, sphere * sphere - base * base))); }
  /// Height of the cylinder; what is zero but for rounding is zero.
  double cylinder() const {
    const double height = thickness - sagitta();
    return std::abs(height) <= 1e-9 * thickness ? 0.0 : height;
  }
  /// The polar angle where the cap ends.
  double rim_angle() const { return std::asin(std::min(1.0, base / sphere)); }
  /// Side and cap meet without a corner, so layers can follow both.
  bool smooth() const { return base == sphere; }
  bool layers_on_side() const { return smooth() && cylinder() > 0.0; }
  double coarse_edge() const { return std::max(fine, std::min(coarse, thickness)); }

  /// The polar angle where a layer's face that is `depth` under the outside ends.
  double rim_angle(double depth) const;
  /// The wanted length of edges.
  double edge_at(const Eigen::Vector3d& x) const;
};

/// The shape in the terms that both kinds share. Nothing is checked.
Outline outline_of(const DomeGel& dome);
Outline outline_of(const FingertipGel& fingertip);

/// @throws Error as check(DomeGel) and check(FingertipGel) say
void check(const Outline& outline);

/// How many tetrahedra a mesh of it will have, within a factor of 1.6.
double estimated_tetrahedra(const Outline& outline);

}  // namespace touchstone::fem
