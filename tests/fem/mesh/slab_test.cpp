#include "fem/mesh/slab.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

/// A gel of the vhs's proportions, coarse enough for a test.
SlabMesh small_slab() {
  SlabMesh slab;
  slab.size_x = 10.0;
  slab.size_y = 8.0;
  slab.thickness = 3.0;
  slab.fine = 0.5;
  slab.coarse = 1.5;
  slab.fine_half_x = 1.5;
  slab.fine_half_y = 2.0;
  slab.fine_depth = 0.5;
  return slab;
}

double total_volume(const TetMesh& mesh) {
  double total = 0.0;
  for (const auto& tetrahedron : mesh.tetrahedra) {
    total += volume(mesh, tetrahedron);
  }
  return total;
}

double area(const TetMesh& mesh, const std::vector<std::array<int, 3>>& faces) {
  Eigen::Vector3d total = Eigen::Vector3d::Zero();
  for (const auto& face : faces) {
    const Eigen::Vector3d& a = mesh.vertices[face[0]];
    total += 0.5 * (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
  }
  return total.z();
}

std::string error_of(const SlabMesh& slab) {
  try {
    mesh_slab(slab);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Slab, FillsItsBox) {
  const TetMesh mesh = mesh_slab(small_slab());
  EXPECT_EQ(fault_of(mesh), "");
  EXPECT_NEAR(total_volume(mesh), 10.0 * 8.0 * 3.0, 1e-9);
  EXPECT_NEAR(area(mesh, mesh.outer), 80.0, 1e-10);
  EXPECT_NEAR(area(mesh, mesh.bonded), -80.0, 1e-10);
}

TEST(Slab, HasNoSliver) {
  EXPECT_GT(smallest_dihedral_angle(mesh_slab(small_slab())) * 180.0 / std::numbers::pi, 5.0);
}

TEST(Slab, IsFineInTheBoxAndCoarseOutside) {
  const SlabMesh slab = small_slab();
  const TetMesh mesh = mesh_slab(slab);
  double longest_fine = 0.0;
  double longest = 0.0;
  for (const auto& face : mesh.outer) {
    double edge = 0.0;
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& a = mesh.vertices[face[k]];
      edge = std::max(edge, (mesh.vertices[face[(k + 1) % 3]] - a).norm());
      inside = inside && std::abs(a.x()) <= slab.fine_half_x && std::abs(a.y()) <= slab.fine_half_y;
    }
    longest = std::max(longest, edge);
    if (inside) {
      longest_fine = std::max(longest_fine, edge);
    }
  }
  EXPECT_LE(longest_fine, 1.3 * slab.fine);  // the lattice ends a row short of the box
  EXPECT_GT(longest, 0.8 * slab.coarse);
  EXPECT_LT(longest, 2.0 * slab.coarse);
}

TEST(Slab, SameInputGivesTheSameMesh) {
  const TetMesh first = mesh_slab(small_slab());
  const TetMesh second = mesh_slab(small_slab());
  EXPECT_EQ(first.tetrahedra, second.tetrahedra);
  EXPECT_EQ(first.outer, second.outer);
  ASSERT_EQ(first.vertices.size(), second.vertices.size());
  for (std::size_t i = 0; i < first.vertices.size(); ++i) {
    EXPECT_EQ(first.vertices[i], second.vertices[i]);
  }
}

TEST(Slab, ScalesWithItsUnits) {
  SlabMesh tiny = small_slab();
  for (double* length : {&tiny.size_x, &tiny.size_y, &tiny.thickness, &tiny.fine, &tiny.coarse, &tiny.fine_half_x,
                         &tiny.fine_half_y, &tiny.fine_depth}) {
    *length *= 1e-6;
  }
  const TetMesh mesh = mesh_slab(tiny);
  EXPECT_NEAR(total_volume(mesh) * 1e18, 240.0, 1e-9);
}

TEST(Slab, EstimateHoldsWithin40Percent) {
  SlabMesh thin = small_slab();
  thin.thickness = 1.0;
  SlabMesh deep = small_slab();
  deep.fine_depth = 3.0;
  SlabMesh all_fine = small_slab();
  all_fine.fine_half_x = all_fine.fine_half_y = 50.0;
  for (const SlabMesh& slab : {small_slab(), SlabMesh(), thin, deep, all_fine}) {
    const auto made = static_cast<double>(mesh_slab(slab).tetrahedra.size());
    EXPECT_NEAR(estimated_tetrahedra(slab) / made, 1.0, 0.4) << made;
  }
}

TEST(Slab, FineBoxMayBeEmptyOrOverTheEdge) {
  SlabMesh slab = small_slab();
  slab.fine_half_x = slab.fine_half_y = slab.fine_depth = 0.0;
  EXPECT_NEAR(total_volume(mesh_slab(slab)), 240.0, 1e-9);
  slab.fine_half_x = slab.fine_half_y = 5.0;  // y ends at 4
  slab.fine = 1.0;
  EXPECT_NEAR(total_volume(mesh_slab(slab)), 240.0, 1e-9);
  slab.coarse = 40.0;  // longer than the slab
  EXPECT_NEAR(total_volume(mesh_slab(slab)), 240.0, 1e-9);
}

TEST(Slab, BadInputIsRefusedBeforeTetGenSeesIt) {
  SlabMesh slab = small_slab();
  slab.thickness = 0.0;
  EXPECT_THAT(error_of(slab), HasSubstr("thickness is 0 mm"));
  slab.thickness = -3.0;
  EXPECT_THAT(error_of(slab), HasSubstr("thickness is -3 mm"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -1.0}) {
    for (int field = 0; field < 8; ++field) {
      slab = small_slab();
      double* lengths[] = {&slab.size_x, &slab.size_y,      &slab.thickness,   &slab.fine,
                           &slab.coarse, &slab.fine_half_x, &slab.fine_half_y, &slab.fine_depth};
      *lengths[field] = bad;
      EXPECT_THAT(error_of(slab), HasSubstr("must be finite")) << field << ' ' << bad;
    }
  }
  slab = small_slab();
  slab.fine = 2.0;
  EXPECT_THAT(error_of(slab), HasSubstr("must not be above the coarse one, 1.5 mm"));
}

TEST(Slab, TooManyTetrahedraAreRefused) {
  SlabMesh slab = small_slab();
  slab.fine = 0.01;
  EXPECT_THAT(error_of(slab), HasSubstr("at most 160000 are allowed"));
  slab.fine = 1e-300;
  EXPECT_THAT(error_of(slab), HasSubstr("at most 160000 are allowed"));
}

TEST(Slab, AspectOf1000IsRefused) {
  SlabMesh slab = small_slab();
  slab.size_x = slab.size_y = 1000.0;
  slab.thickness = 1.0;
  EXPECT_THAT(error_of(slab), HasSubstr("at most 200 times its shortest"));
  slab.size_x = slab.size_y = 100.0;  // aspect 100: meshed no longer than thick, over the budget
  slab.coarse = 100.0;
  slab.thickness = 0.6;
  EXPECT_THAT(error_of(slab), HasSubstr("at most 160000 are allowed"));
}

}  // namespace
}  // namespace touchstone::fem
