#include "fem/elements/surface_coupling.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;

TEST(SurfaceCoupling, IntegratesQuadraticFieldsExactly) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 3, 2, 1, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  const OuterSurface surface = outer_surface(mesh);
  Eigen::VectorXd field(space.nodes);
  for (int node = 0; node < space.nodes; ++node) {
    const Vector3d x = space.position(node);
    field[node] = 1.0 + x.x() + x.x() * x.x() + 2.0 * x.x() * x.y();
  }
  // Sum over the hats, which is one: the field's own integral over 3 x 2. Against x: its first moment.
  const Eigen::VectorXd weighted = surface_coupling(space, surface) * field;
  EXPECT_NEAR(weighted.sum(), 6.0 * (1.0 + 9.0 / 12.0), 1e-13);
  double moment = 0.0;
  for (std::size_t i = 0; i < surface.mesh_vertex.size(); ++i) {
    moment += mesh.vertices[surface.mesh_vertex[i]].x() * weighted[static_cast<Eigen::Index>(i)];
  }
  EXPECT_NEAR(moment, 6.0 * 9.0 / 12.0, 1e-13);
}

TEST(SurfaceCoupling, AgreesWithTheMassOnLinearFields) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 3, 2, 1, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  const OuterSurface surface = outer_surface(mesh);
  Eigen::VectorXd field(space.nodes);
  for (int node = 0; node < space.nodes; ++node) {
    field[node] = space.position(node).dot(Vector3d(1, -2, 5)) + 0.3;
  }
  Eigen::VectorXd at_vertices(static_cast<Eigen::Index>(surface.mesh_vertex.size()));
  for (std::size_t i = 0; i < surface.mesh_vertex.size(); ++i) {
    at_vertices[static_cast<Eigen::Index>(i)] = field[surface.mesh_vertex[i]];
  }
  const Eigen::VectorXd difference =
      surface_coupling(space, surface) * field - surface_mass(mesh, surface) * at_vertices;
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_NEAR(surface_mass(mesh, surface).sum(), 6.0, 1e-13);
}

TEST(BeadMeans, OfAQuadraticFieldIsItsCentreAndASixthOfItsLaplacian) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 4, 3, 2, 0.15);
  const TaylorHoodSpace space = make_space(mesh);
  Eigen::VectorXd field(space.nodes);
  for (int node = 0; node < space.nodes; ++node) {
    const Vector3d x = space.position(node);
    field[node] = 0.5 + x.x() - x.z() + x.x() * x.x() + 3.0 * x.y() * x.y() + x.y() * x.z();  // Laplacian 8
  }
  const std::vector<Bead> beads = {{{0.1, -0.2, -0.5}, 0.3}, {{-1.0, 0.5, -0.25}, 0.2}};
  const Eigen::VectorXd means = bead_means(space, beads) * field;
  for (std::size_t b = 0; b < beads.size(); ++b) {
    const Vector3d c = beads[b].centre;
    const double at_centre = 0.5 + c.x() - c.z() + c.x() * c.x() + 3.0 * c.y() * c.y() + c.y() * c.z();
    EXPECT_NEAR(means[static_cast<Eigen::Index>(b)], at_centre + beads[b].radius * beads[b].radius * 8.0 / 6.0, 1e-12);
  }
}

TEST(BeadMeans, BeadMustBeWhollyInside) {
  const TetMesh mesh = fixtures::box_mesh({3, 2, 1}, 4, 3, 2);
  const TaylorHoodSpace space = make_space(mesh);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Bead& bad : {Bead{{0, 0, -0.2}, 0.25},    // through the outer face
                          Bead{{0, 0, -0.9}, 0.25},    // through the plate
                          Bead{{1.4, 0, -0.5}, 0.25},  // through a side
                          Bead{{0, 0, 0.5}, 0.25},     // above
                          Bead{{9, 0, -0.5}, 0.25},    // far away
                          Bead{{0, 0, -0.5}, 5.0},     // larger than the gel
                          Bead{{0, 0, -0.5}, 0.0}, Bead{{0, 0, -0.5}, nan}, Bead{{0, nan, -0.5}, 0.25}}) {
    EXPECT_THROW(bead_means(space, std::vector<Bead>{bad}), Error) << bad.centre.transpose() << ' ' << bad.radius;
  }
  EXPECT_NO_THROW(bead_means(space, std::vector<Bead>{{{0, 0, -0.25}, 0.25}}));  // touches the outer face
}

}  // namespace
}  // namespace touchstone::fem
