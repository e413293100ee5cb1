#pragma once

#include <Eigen/Core>

#include "fem/mesh/gel_body.h"

namespace touchstone::test {

/// A box, z from -size.z() to 0, its top the outer face and its bottom bonded.
inline fem::SolidGel box_gel(const Eigen::Vector3d& size) {
  fem::SolidGel gel;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d at((corner & 1) ? 0.5 : -0.5, (corner & 2) ? 0.5 : -0.5, (corner & 4) ? 0.0 : -1.0);
    gel.surface.vertices.push_back(at.cwiseProduct(size));
  }
  gel.surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                           {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  gel.faces.assign(12, fem::FaceKind::side);
  gel.faces[0] = gel.faces[1] = fem::FaceKind::bonded;
  gel.faces[2] = gel.faces[3] = fem::FaceKind::outer;
  return gel;
}

}  // namespace touchstone::test
