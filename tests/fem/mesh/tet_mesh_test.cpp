#include "fem/mesh/tet_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "fem/elements/taylor_hood.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

TetMesh regular_tetrahedron() {
  TetMesh mesh;
  mesh.vertices = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  mesh.tetrahedra = {{0, 2, 1, 3}};
  if (volume(mesh, mesh.tetrahedra[0]) < 0.0) {
    std::swap(mesh.tetrahedra[0][0], mesh.tetrahedra[0][1]);
  }
  const auto faces = boundary_faces(mesh);
  mesh.outer = {faces[0]};
  mesh.bonded = {faces[1]};
  return mesh;
}

TEST(TetMesh, BoxHasItsVolumeAndItsSurface) {
  const TetMesh mesh = fixtures::box_mesh({2, 3, 4}, 3, 2, 4, 0.1);
  double total = 0.0;
  for (const auto& tetrahedron : mesh.tetrahedra) {
    total += volume(mesh, tetrahedron);
  }
  EXPECT_NEAR(total, 24.0, 1e-12);
  EXPECT_EQ(boundary_faces(mesh).size(), 2u * 2u * (3 * 2 + 2 * 4 + 3 * 4));
  EXPECT_EQ(mesh.outer.size(), 12u);
  EXPECT_EQ(fault_of(mesh), "");
}

TEST(TetMesh, RegularTetrahedronHasItsDihedralAngle) {
  EXPECT_NEAR(smallest_dihedral_angle(regular_tetrahedron()), std::acos(1.0 / 3.0), 1e-14);
}

TEST(TetMesh, SliverIsReportedByItsSmallestAngle) {
  // Four points near a square's corners, a 1000th of its side off the plane: nearly flat, no short edge.
  TetMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0.001}, {1, 1, 0}, {0, 1, 0.001}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  if (volume(mesh, mesh.tetrahedra[0]) < 0.0) {
    std::swap(mesh.tetrahedra[0][0], mesh.tetrahedra[0][1]);
  }
  // Faces on one diagonal meet at the angle whose tangent is height over half the diagonal, twice.
  EXPECT_NEAR(smallest_dihedral_angle(mesh), 2.0 * std::atan(0.0005 * 2.0 / std::numbers::sqrt2), 2e-3);
  EXPECT_LT(smallest_dihedral_angle(mesh), 0.003);
}

TEST(TetMesh, EachFaultIsNamed) {
  const TetMesh good = fixtures::box_mesh({1, 1, 1}, 1, 1, 1);
  ASSERT_EQ(fault_of(good), "");
  TetMesh bad = good;
  bad.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(fault_of(bad), HasSubstr("vertex 3 isn't finite"));
  bad = good;
  std::swap(bad.tetrahedra[2][0], bad.tetrahedra[2][1]);
  EXPECT_THAT(fault_of(bad), HasSubstr("tetrahedron 2 has a volume of"));
  bad = good;
  for (auto& vertex : bad.vertices) {
    vertex.z() = 0.0;
  }
  EXPECT_THAT(fault_of(bad), HasSubstr("must be above zero"));
  bad = good;
  bad.tetrahedra[0][1] = 8;
  EXPECT_THAT(fault_of(bad), HasSubstr("names vertex 8 of 8"));
  bad = good;
  bad.vertices.emplace_back(5, 5, 5);
  EXPECT_THAT(fault_of(bad), HasSubstr("vertex 8 belongs to no tetrahedron"));
  bad = good;
  bad.tetrahedra.push_back(bad.tetrahedra[0]);
  bad.tetrahedra.push_back(bad.tetrahedra[0]);
  EXPECT_THAT(fault_of(bad), HasSubstr("tetrahedra"));
  bad = good;
  std::swap(bad.outer[0][0], bad.outer[0][1]);
  EXPECT_THAT(fault_of(bad), HasSubstr("outer triangle 0 points into the solid"));
  bad = good;
  bad.outer.clear();
  EXPECT_THAT(fault_of(bad), HasSubstr("no outer surface"));
  bad = good;
  bad.bonded.push_back(bad.outer[0]);
  EXPECT_THAT(fault_of(bad), HasSubstr("bonded triangle 2"));
  bad = good;
  bad.bonded.clear();
  EXPECT_THAT(fault_of(bad), HasSubstr("bonded nowhere"));
  bad.tetrahedra.clear();
  EXPECT_THAT(fault_of(bad), HasSubstr("no tetrahedra"));
}

TEST(TetMesh, PieceThatIsntBondedIsRefused) {
  TetMesh mesh = fixtures::box_mesh({1, 1, 1}, 1, 1, 1);
  const TetMesh other = mesh;
  const int offset = static_cast<int>(mesh.vertices.size());
  for (const auto& vertex : other.vertices) {
    mesh.vertices.push_back(vertex + Eigen::Vector3d(3, 0, 0));
  }
  for (auto tetrahedron : other.tetrahedra) {
    for (int& v : tetrahedron) {
      v += offset;
    }
    mesh.tetrahedra.push_back(tetrahedron);
  }
  EXPECT_THAT(fault_of(mesh), HasSubstr("the piece with vertex 8 is bonded nowhere"));
  EXPECT_THROW(make_space(mesh), Error);
}

}  // namespace
}  // namespace touchstone::fem
