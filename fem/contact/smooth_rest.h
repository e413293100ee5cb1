#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/contact/contact_gap.h"
#include "fem/contact/half_space_response.h"
#include "fem/elements/compliance.h"

namespace touchstone::fem {

/// What a gel's response is beyond a half-space's near one of its vertices: smooth, since it comes from the gel's other
/// faces. Finite elements add an error of a few per cent to a vertex's response to its own hat and to the next ones',
/// which would let two densities that lie nearly on each other answer as if work could be had from them.
class SmoothRest {
 public:
  /// Keeps references. `axes_of_all`: of each vertex, see ContactBlock.
  SmoothRest(const Compliance& gel, const ContactSurface& surface, const HalfSpaceResponse& half_space,
             const std::vector<Eigen::Matrix3d>& axes_of_all)
      : gel_(gel), surface_(surface), half_space_(half_space), axes_(axes_of_all) {}

  /// Fits around a vertex; false where too few others are near, or none on one side: where the gel ends its response
  /// isn't smooth, and a fit to one side says nothing of the other.
  bool fit(int vertex);

  /// mm, the mean of those at the vertex that was fitted.
  double edge() const { return edge_; }

  /// mm/MPa/mm^2: displacement at a vertex by a unit traction's hat on the fitted one, over both weights.
  Eigen::Matrix3d at(int v) const;

 private:
  double edge_at(int vertex) const;
  Eigen::Vector2d along(int v) const;
  Eigen::Matrix<double, 1, 6> terms(int v) const;
  Eigen::Matrix3d half_space_at(int v) const;

  const Compliance& gel_;
  const ContactSurface& surface_;
  const HalfSpaceResponse& half_space_;
  const std::vector<Eigen::Matrix3d>& axes_;
  int vertex_ = 0;
  double edge_ = 1.0;
  Eigen::Matrix<double, 6, 9> coefficients_;
};

}  // namespace touchstone::fem
