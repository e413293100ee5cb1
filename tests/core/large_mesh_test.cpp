#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/triangle_mesh.h"
#include "tests/core/test_solids.h"

namespace touchstone {
namespace {

using testing::HasSubstr;

TEST(LargeMesh, FiftyThousandTrianglesAreChecked) {
  const TriangleMesh mesh = sphere(160, 160);
  ASSERT_GT(mesh.triangles.size(), 50000u);
  EXPECT_EQ(fault_of_closed_mesh(mesh), "");
  EXPECT_THAT(fault_of_closed_mesh(both(mesh, shifted(mesh, {1.9, 0.1, 0.0}))), HasSubstr("cross"));
}

// All boxes of a cap's triangles overlap: they share its centre.
TEST(LargeMesh, FansAreChecked) {
  EXPECT_EQ(fault_of_closed_mesh(sphere(3, 1500)), "");
}

}  // namespace
}  // namespace touchstone
