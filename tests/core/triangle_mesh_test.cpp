#include "core/triangle_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/transform.h"
#include "core/triangle_crossing.h"
#include "core/units.h"
#include "tests/core/test_solids.h"

namespace touchstone {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

const RigidTransform kOblique = {rotation_from_xyz({0.3, 0.7, -0.4}), {13.0, -5.0, 21.0}};

TEST(ClosedMesh, SoundSolidsHaveNoFault) {
  EXPECT_EQ(fault_of_closed_mesh(cube()), "");
  EXPECT_EQ(fault_of_closed_mesh(cube(7)), "");
  EXPECT_EQ(fault_of_closed_mesh(sphere(20, 30)), "");
  EXPECT_EQ(fault_of_closed_mesh(both(cube(3), shifted(cube(3), {1.0 + 1e-9, 0, 0}))), "") << "two bodies";
}

// Rounding bends a turned cube's flat faces by the last bit, so nothing in them is coplanar any more, nor far from it.
TEST(ClosedMesh, TurningOrScalingASolidMakesNoFault) {
  for (const double scale : {1e-6, 1.0, 1e5}) {
    TriangleMesh mesh = moved(cube(12), kOblique);
    for (Vector3d& vertex : mesh.vertices) vertex *= scale;
    EXPECT_EQ(fault_of_closed_mesh(mesh), "") << scale;
  }
}

TEST(ClosedMesh, HollowSolidIsSound) {
  EXPECT_EQ(fault_of_closed_mesh(both(sphere(10, 12, 2.0), turned_inside_out(sphere(10, 12, 1.0)))), "");
}

TEST(ClosedMesh, BadNumbersAreNamed) {
  TriangleMesh mesh = cube();
  mesh.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fault_of_closed_mesh(mesh), "vertex 3 isn't finite");
  mesh.vertices[3].y() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(fault_of_closed_mesh(mesh), "vertex 3 isn't finite");
  for (const int index : {-1, 8, std::numeric_limits<int>::max()}) {
    mesh = cube();
    mesh.triangles[5][1] = index;
    EXPECT_THAT(fault_of_closed_mesh(mesh), HasSubstr("triangle 5 names vertex " + std::to_string(index)));
  }
  EXPECT_EQ(fault_of_closed_mesh({}), "it has no triangles");
}

TEST(ClosedMesh, TrianglesWithoutAreaAreNamed) {
  TriangleMesh mesh = cube();
  mesh.triangles[4][2] = mesh.triangles[4][1];
  EXPECT_EQ(fault_of_closed_mesh(mesh), "triangle 4 has no area");
  mesh = {{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}, {0, 1, 0}}, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};
  EXPECT_EQ(fault_of_closed_mesh(mesh), "triangle 0 has no area");
}

TEST(ClosedMesh, OpenSurfacesAreNamed) {
  TriangleMesh mesh = cube();
  const auto gone = mesh.triangles.back();
  mesh.triangles.pop_back();
  EXPECT_THAT(fault_of_closed_mesh(mesh), HasSubstr("belongs to 1 triangle: the surface is open"));
  EXPECT_THAT(fault_of_closed_mesh(mesh), HasSubstr(std::to_string(*std::min_element(gone.begin(), gone.end()))));
  EXPECT_THAT(fault_of_closed_mesh(split_cube(2)), HasSubstr("open"));
}

TEST(ClosedMesh, NonManifoldEdgesAreNamed) {
  TriangleMesh mesh = cube();
  mesh.triangles.push_back({0, 1, static_cast<int>(mesh.vertices.size())});
  mesh.vertices.emplace_back(5, 5, 5);
  EXPECT_THAT(fault_of_closed_mesh(mesh), HasSubstr("belongs to 3 triangles"));
  TriangleMesh twice = both(cube(), shifted(cube(), {1, 1, 0}));  // they share an edge once welded
  EXPECT_THAT(fault_of_closed_mesh(weld(twice, 1e-9)), HasSubstr("belongs to 4 triangles"));
}

TEST(ClosedMesh, WrongSensesAreNamed) {
  EXPECT_EQ(fault_of_closed_mesh(turned_inside_out(cube(2))), "it is inside out");
  TriangleMesh mesh = cube(2);
  std::swap(mesh.triangles[9][0], mesh.triangles[9][1]);
  EXPECT_THAT(fault_of_closed_mesh(mesh), HasSubstr("have opposite orientations"));
}

TEST(ClosedMesh, CrossingBodiesAreNamed) {
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), shifted(cube(), {0.5, 0.4, 0.3}))), HasSubstr("cross"));
  // One face of each in the same plane.
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), shifted(cube(), {0.5, 0.4, 0.0}))), HasSubstr("cross"));
  // The same body twice.
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), cube())), HasSubstr("cross"));
  // A needle through a face, no vertex of either inside the other's triangles' edges.
  TriangleMesh needle = {{{0.4, 0.3, -1}, {0.41, 0.3, -1}, {0.4, 0.31, -1}, {0.4, 0.3, 3}},
                         {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  ASSERT_EQ(fault_of_closed_mesh(needle), "");
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), needle)), HasSubstr("cross"));
}

TEST(ClosedMesh, TouchingCountsAndAHairsBreadthDoesNot) {
  const double hair = 0x1.0p-50;
  const TriangleMesh tip = {{{0.3, 0.2, 1}, {0.3, 0.4, 2}, {0.1, 0.1, 2}, {0.5, 0.1, 2}},
                            {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}}};
  ASSERT_EQ(fault_of_closed_mesh(tip), "");
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), tip)), HasSubstr("cross")) << "a tip on a face";
  EXPECT_EQ(fault_of_closed_mesh(both(cube(), shifted(tip, {0, 0, hair}))), "");
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), shifted(tip, {0, 0, -hair}))), HasSubstr("cross"));
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), shifted(cube(), {1, 0, 0}))), HasSubstr("cross")) << "face on face";
  EXPECT_THAT(fault_of_closed_mesh(both(cube(), shifted(cube(), {1, 1, 1}))), HasSubstr("cross")) << "corner on corner";
}

TEST(ClosedMesh, ASurfaceThatCrossesItselfIsNamed) {
  TriangleMesh mesh = sphere(16, 24);
  mesh.vertices[0] = {0.1, 0.07, -3.0};  // the north pole pulled out through the south
  const std::string fault = fault_of_closed_mesh(mesh);
  EXPECT_THAT(fault, HasSubstr("cross"));
  mesh.vertices[0] = {0.1, 0.07, -0.5};  // only dented
  EXPECT_EQ(fault_of_closed_mesh(mesh), "");
}

TEST(ClosedMesh, FoldedTrianglesAreNamed) {
  // A vertex of a flat face moved, in the face's plane, over the far side of its neighbours.
  TriangleMesh mesh = cube(4);
  const auto inner = std::find_if(mesh.vertices.begin(), mesh.vertices.end(),
                                  [](const Vector3d& v) { return v == Vector3d(0.5, 0.5, 1.0); });
  ASSERT_NE(inner, mesh.vertices.end());
  *inner = {0.9, 0.57, 1.0};
  EXPECT_THAT(fault_of_closed_mesh(mesh), HasSubstr("cross"));
  *inner = {0.55, 0.6, 1.0};
  EXPECT_EQ(fault_of_closed_mesh(mesh), "");
}

TEST(ClosedMesh, FindsACrossingWhereverThePairsStand) {
  // Brute force over the same exact test: a pair alone in a mesh of two triangles.
  const TriangleMesh mesh = both(moved(cube(2), kOblique), shifted(moved(cube(2), kOblique), {0.83, 0.4, 0.2}));
  int crossings = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t j = i + 1; j < mesh.triangles.size(); ++j) {
      TriangleMesh pair = {mesh.vertices, {mesh.triangles[i], mesh.triangles[j]}};
      TriangleMesh swapped = {mesh.vertices, {mesh.triangles[j], mesh.triangles[i]}};
      const bool cross = first_crossing(pair).has_value();
      ASSERT_EQ(cross, first_crossing(swapped).has_value());
      crossings += cross;
    }
  }
  ASSERT_GT(crossings, 0);
  const auto found = first_crossing(mesh);
  ASSERT_TRUE(found.has_value());
  TriangleMesh pair = {mesh.vertices, {mesh.triangles[found->first], mesh.triangles[found->second]}};
  EXPECT_TRUE(first_crossing(pair).has_value());
  EXPECT_LT(found->first, found->second);
}

TEST(EnclosedVolume, IsThatOfTheSolid) {
  EXPECT_NEAR(enclosed_volume(cube(5)), 1.0, 1e-13);
  EXPECT_NEAR(enclosed_volume(shifted(cube(5), {1e6, -1e6, 1e6})), 1.0, 1e-8) << "far from the origin";
  EXPECT_NEAR(enclosed_volume(turned_inside_out(cube(5))), -1.0, 1e-13);
  EXPECT_NEAR(enclosed_volume(sphere(160, 160)), 4.0 / 3.0 * kPi, 4e-3);
  EXPECT_EQ(enclosed_volume({}), 0.0);
}

TEST(Weld, ClosesSeamsAndKeepsTheSolid) {
  const TriangleMesh split = split_cube(6);
  const TriangleMesh welded = weld(split, 1e-6);
  EXPECT_EQ(welded.vertices.size(), static_cast<std::size_t>(7 * 7 * 7 - 5 * 5 * 5));
  EXPECT_EQ(welded.triangles.size(), split.triangles.size());
  EXPECT_EQ(fault_of_closed_mesh(welded), "");
  EXPECT_EQ(enclosed_volume(welded), enclosed_volume(weld(split, 0.0)));
  // Welding again changes nothing.
  EXPECT_EQ(weld(welded, 1e-6).triangles, welded.triangles);
}

TEST(Weld, JoinsWhatIsNearerThanTheDistanceAcrossCells) {
  for (const Vector3d& origin : {Vector3d(0, 0, 0), Vector3d(-3.0, 5.0, 0.1), Vector3d(0.0999999, -0.1, 7.0)}) {
    TriangleMesh mesh = {{origin, origin + Vector3d(0.06, 0.06, 0.05), origin + Vector3d(1, 0, 0),
                          origin + Vector3d(0, 1, 0), origin - Vector3d(0.06, 0.06, 0.06)},
                         {{0, 2, 3}, {1, 2, 3}, {0, 1, 2}, {4, 2, 3}}};
    const TriangleMesh welded = weld(mesh, 0.1);  // 1 is 0.098 away, 4 is 0.104
    EXPECT_EQ(welded.vertices.size(), 4u);
    ASSERT_EQ(welded.triangles.size(), 3u) << "one triangle collapsed";
    EXPECT_EQ(welded.triangles[0], welded.triangles[1]);
    EXPECT_NE(welded.triangles[0], welded.triangles[2]);
  }
}

TEST(Weld, LeavesBadInputForTheCheckToFind) {
  TriangleMesh mesh = cube();
  mesh.vertices[2].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(fault_of_closed_mesh(weld(mesh, 1e-6)), HasSubstr("isn't finite"));
  mesh = cube();
  mesh.triangles[0][0] = 99;
  EXPECT_THAT(fault_of_closed_mesh(weld(mesh, 1e-6)), HasSubstr("names vertex"));
  mesh = cube();
  mesh.vertices[0] *= 1e300;
  EXPECT_NO_THROW(weld(mesh, 1e-300));
}

}  // namespace
}  // namespace touchstone
