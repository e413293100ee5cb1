// Bodies whose outline lies among the mesh's vertices: flat punches of a few edges, blocks on a plate, sides that lie
// exactly on edges.

#include "fem/contact/cut_hats.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "core/units.h"
#include "fem/contact/contact_gap.h"
#include "fem/contact/press.h"
#include "fem/mesh/slab.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::target_at;

constexpr double kModulus = 0.2;
constexpr double kPoisson = 0.48;
constexpr double kThickness = 3.0;
constexpr double kEdge = 0.6;

const Compliance& gel() {
  static const Compliance made = [] {
    SlabMesh slab;
    slab.size_x = slab.size_y = 24.0;
    slab.thickness = kThickness;
    slab.fine = kEdge;
    slab.coarse = 1.2;
    slab.fine_half_x = slab.fine_half_y = 3.6;
    slab.fine_depth = 1.2;
    return compute_compliance(mesh_slab(slab), {kModulus, kPoisson}, {}, slab.thickness);
  }();
  return made;
}

/// Exactly on a node, on an edge's middle, and anywhere.
constexpr std::array<std::array<double, 2>, 6> kPlaces = {
    {{0.0, 0.0}, {0.3, 0.0}, {0.071, 0.153}, {-0.229, 0.228}, {0.142, -0.295}, {-0.158, 0.0}}};

double force_at(Press&& press, const PressTarget& target) {
  return press.step(target).wrench[2];
}

TEST(CutHats, FlatPunchesDownToHalfAnEdgeMeetTheLayersClosedForm) {
  // Measured: -1.5, -1.7, -1.5, -1.3 and -0.9 % for these rows, the same at all places to 0.2 % and, for five edges,
  // 0.4. With cells that bore in their middles and not where the rise draws the pressure, half an edge had -4.8 % and
  // the others -2.9 to -2.5; when a hat bore or didn't, half an edge had -80 +- 34 % and one +-12 %.
  struct Row {
    double edges;
    double low;
    double high;
    double spread;
  };
  for (const Row& row : {Row{0.5, -0.022, 0.0, 0.004}, Row{1.0, -0.024, 0.0, 0.004}, Row{1.5, -0.02, 0.0, 0.002},
                         Row{2.5, -0.017, 0.0, 0.001}, Row{5.0, -0.014, 0.0, 0.005}}) {
    const double radius = row.edges * kEdge;
    const double wanted = closed_forms::flat_punch_on_layer(kModulus, kPoisson, kThickness, radius, 0.05).force;
    double least = 1.0;
    double most = -1.0;
    for (const auto& place : kPlaces) {
      const double off =
          force_at(Press(gel(), RoundedCylinder{radius, 0.0, 1.0}, 0.0), target_at(place[0], place[1], -0.05)) /
              wanted -
          1.0;
      least = std::min(least, off);
      most = std::max(most, off);
    }
    EXPECT_GT(least, row.low) << row.edges;
    EXPECT_LT(most, row.high) << row.edges;
    EXPECT_LT(most - least, 2.0 * row.spread) << row.edges;
  }
}

/// A block of width w and height h, its lower face at z = 0, under a plate that is `margin` wider all round.
TriangleMesh block_on_plate(double width, double height, double margin, double plate) {
  TriangleMesh mesh;
  const auto square = [&](double half, double z) {
    const int first = static_cast<int>(mesh.vertices.size());
    for (const auto& [x, y] : {std::pair{-half, -half}, {half, -half}, {half, half}, {-half, half}}) {
      mesh.vertices.emplace_back(x, y, z);
    }
    return first;
  };
  const auto face = [&](int a, int b, int c, int d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  const double half = 0.5 * width;
  const std::array<int, 4> rings = {square(half, 0.0), square(half, height), square(half + margin, height),
                                    square(half + margin, height + plate)};
  face(rings[0] + 3, rings[0] + 2, rings[0] + 1, rings[0]);
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    for (int k = 0; k < 4; ++k) {
      const int next = (k + 1) % 4;
      face(rings[r] + k, rings[r] + next, rings[r + 1] + next, rings[r + 1] + k);
    }
  }
  face(rings[3], rings[3] + 1, rings[3] + 2, rings[3] + 3);
  return mesh;
}

TEST(CutHats, ABlockUnderAPlateThatDoesntTouchIsTheBlockAlone) {
  // It was 18 to 47 % softer as long as the plate was within some edges.
  for (const double width : {2.0, 4.2}) {
    for (const double degrees : {0.0, 17.0, 45.0}) {
      const auto target = [&](double z) {
        PressTarget turned = target_at(0.13, degrees == 0.0 ? 0.0 : -0.21, z);
        turned.rotation = Eigen::AngleAxisd(degrees * kRadiansPerDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
        return turned;
      };
      const double alone = force_at(Press(gel(), BoxShape{{width, width, 2.0}}, 0.0), target(0.95));
      for (const double height : {0.2, 0.5, 1.0, 2.0}) {
        const MeshShape block(block_on_plate(width, height, 0.5, 1.0));
        EXPECT_NEAR(force_at(Press(gel(), block, 0.0), target(-0.05)), alone, 0.005 * alone)
            << width << " mm wide, " << height << " mm high, turned by " << degrees;
      }
    }
  }
}

TEST(CutHats, SidesOnEdgesOfTheMeshAreNoSpecialCase) {
  // With friction, at loads from a tenth of a newton to one: exactly on the mesh's lines and a micrometre beside them.
  const BoxShape box{{4.0 * kEdge, 4.0 * kEdge, 2.0}};
  for (const double newton : {0.1, 0.3, 1.0}) {
    std::vector<double> depth;
    for (const double beside : {0.0, 1e-3}) {
      Press press(gel(), box, 0.5);
      PressTarget target = target_at(beside, beside, 0.0);
      target.axis[2] = AxisControl::with_force(newton);
      depth.push_back(1.0 - press.step(target).gel_from_object.translation.z());
    }
    EXPECT_GT(depth[0], 0.0);
    EXPECT_NEAR(depth[0], depth[1], 0.005 * depth[1]) << newton;
  }
}

TEST(CutHats, TheStiffnessOfAFlatPunchIsTheSameAtAllLoads) {
  std::vector<double> stiffness;
  for (const double newton : {0.02, 0.1, 0.4}) {
    Press press(gel(), RoundedCylinder{1.2, 0.0, 1.0}, 0.0);
    PressTarget target = target_at(0.0, 0.0, 0.0);
    target.axis[2] = AxisControl::with_force(newton);
    stiffness.push_back(newton / -press.step(target).gel_from_object.translation.z());
  }
  // The gel under the punch moves along itself with the load, by 0.00025 mm at 0.4 N, and the hats are cut there.
  EXPECT_NEAR(stiffness[1], stiffness[0], 1e-4 * stiffness[0]);
  EXPECT_NEAR(stiffness[2], stiffness[0], 1e-4 * stiffness[0]);
}

TEST(CutHats, AMovedBodyChangesItsForceWithoutJumps) {
  // Across a whole edge in small steps: what one step changes is small beside what a hat bears.
  double last = 0.0;
  double least = 1e9;
  double most = 0.0;
  for (int k = 0; k <= 40; ++k) {
    const double x = kEdge * k / 40.0;
    const double force =
        force_at(Press(gel(), RoundedCylinder{0.75 * kEdge, 0.0, 1.0}, 0.0), target_at(x, 0.37 * x, -0.05));
    if (k > 0) {
      EXPECT_NEAR(force, last, 0.006 * last) << x;  // 0.51 % at most when it was written
    }
    least = std::min(least, force);
    most = std::max(most, force);
    last = force;
  }
  EXPECT_LT(most / least, 1.03);
}

TEST(CutHats, DensitiesKeepEachVertexsWeightAndLieUnderTheBody) {
  const ContactSurface surface(gel());
  const double radius = 1.1;
  const ContactShape punch = RoundedCylinder{radius, 0.0, 1.0};
  RigidTransform pose;
  pose.translation = {0.07, -0.11, -0.05};
  const WeightedGap gap = weighted_gap(surface, punch, pose, {}, {}, true);
  ASSERT_TRUE(gap.cuts);
  EXPECT_FALSE(gap.cuts->by_overlap);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(surface.weight.size());
  for (const CutTriangle& triangle : gap.cuts->triangles) {
    for (const DensityCell& cell : triangle.cells) {
      const double out = (cell.at - pose.translation).head<2>().norm();
      for (int a = 0; a < 3; ++a) {
        const int v = surface.triangles[triangle.triangle][a];
        sum[v] += cell.density[a];
        if (place_in(*gap.cuts, v) >= 0 && out > radius + 0.25 * kEdge) {
          EXPECT_EQ(cell.density[a], 0.0);
        }
      }
    }
  }
  double covered = 0.0;
  for (std::size_t k = 0; k < gap.cuts->vertices.size(); ++k) {
    const int v = gap.cuts->vertices[k];
    const double share = gap.cuts->share[static_cast<Eigen::Index>(k)];
    EXPECT_GE(share, 0.0);
    EXPECT_LE(share, 1.0 + 1e-12);
    if (share > 0.0) {
      EXPECT_NEAR(sum[v], surface.weight[v], 1e-9 * surface.weight[v]);
      EXPECT_NEAR(gap.cuts->gap[static_cast<Eigen::Index>(k)], -0.05, 1e-12);
    }
    covered += share * surface.weight[v];
  }
  // Hats that aren't cut lie wholly under the punch.
  for (Eigen::Index v = 0; v < surface.weight.size(); ++v) {
    if (place_in(*gap.cuts, static_cast<int>(v)) < 0 && std::isfinite(gap.weighted[v])) covered += surface.weight[v];
  }
  EXPECT_NEAR(covered, kPi * radius * radius, 0.01 * kPi * radius * radius);
}

TEST(CutHats, GapsAfterASmallMotionAreThoseOfHatsCutAnew) {
  const ContactSurface surface(gel());
  const ContactShape ball = SphereShape{0.4};
  RigidTransform pose;
  pose.translation = {0.05, 0.02, 0.3};
  const WeightedGap before = weighted_gap(surface, ball, pose, {}, {}, true);
  ASSERT_TRUE(before.cuts);
  EXPECT_TRUE(before.cuts->by_overlap);
  pose.translation.z() -= 0.002;
  const WeightedGap kept = weighted_gap(surface, ball, pose, {}, {}, true, before.cuts);
  EXPECT_EQ(kept.cuts, before.cuts);
  for (const int v : before.cuts->vertices) {
    if (!std::isfinite(before.plain[v])) continue;
    EXPECT_NEAR(kept.plain[v], before.plain[v] - 0.002 * surface.weight[v], 1e-9 * surface.weight[v]);
  }
}

TEST(CutHats, ANeedleNarrowerThanAnEdgeIsTouchedWhereverItStands) {
  // Hertz's force on a half-space, which a layer of ten times the contact's width is to some percent.
  const double radius = 0.2;
  const double depth = 0.06;  // a contact of 0.11 mm, a fifth of an edge
  const double wanted = 4.0 / 3.0 * kModulus / (1.0 - kPoisson * kPoisson) * std::sqrt(radius) * std::pow(depth, 1.5);
  for (const auto& place : kPlaces) {
    const double force =
        force_at(Press(gel(), SphereShape{radius}, 0.0), target_at(place[0], place[1], radius - depth));
    EXPECT_NEAR(force, wanted, 0.25 * wanted) << place[0] << ' ' << place[1];
  }
}

TEST(CutHats, SteepTipsArePressedByDepthAndByForceWhereverTheyStand) {
  // A press by force begins where the body just touches: there a tip covers nothing, and hats that are cut by the
  // cone's base say nothing of what the tip will cut.
  struct Row {
    ConeShape cone;
    double spread;  // of the forces at the places; measured when it was written: 0.081 and 0.043
  };
  for (const Row& row : {Row{{0.23, 2.0, 0.15}, 0.1}, Row{{0.9, 2.0, 0.0}, 0.06}}) {
    for (const double friction : {0.0, 0.5}) {
      double least = std::numeric_limits<double>::infinity();
      double most = 0.0;
      for (const auto& place : kPlaces) {
        PressTarget target = target_at(place[0], place[1], -0.3);
        const double newton = force_at(Press(gel(), row.cone, friction), target);
        least = std::min(least, newton);
        most = std::max(most, newton);
        ASSERT_GT(newton, 0.0) << place[0] << ' ' << place[1];
        target.axis[2] = AxisControl::with_force(newton);
        Press press(gel(), row.cone, friction);
        EXPECT_NEAR(press.step(target).gel_from_object.translation.z(), -0.3, 0.003)
            << place[0] << ' ' << place[1] << ", mu " << friction;
      }
      EXPECT_LT(most - least, row.spread * least) << friction;
    }
  }
}

TEST(CutHats, APlateAsLargeAsTheGelIsPressedAndShearedWithFriction) {
  // Where the gel ends it answers softer than a half-space: a plate whose outline lies near the gel's own found no
  // answer with friction.
  for (const double edge : {0.9, 0.6}) {
    const Compliance pad =
        compute_compliance(mesh_slab({8.0, 8.0, 2.0, edge, edge, 4.0, 4.0, edge}), {1.0, 0.45}, {}, 2.0);
    for (const double friction : {0.5, 50.0}) {
      double before = 0.0;
      for (const double side : {6.5, 7.0, 7.5, 7.9, 8.0, 9.0}) {
        Press press(pad, BoxShape{{side, side, 2.0}}, friction);
        const double force = press.step(target_at(0.013, 0.009, 0.95)).wrench[2];
        const double aside = -press.step(target_at(0.033, 0.009, 0.95)).wrench[0];
        // A wider plate never takes less, but for 1.0 % between one that ends at the gel's end and one that covers all:
        // measured when it was written.
        EXPECT_GT(force, 0.985 * before) << edge << ' ' << friction << ' ' << side;
        if (side > 8.0) {
          EXPECT_NEAR(force, before, 0.015 * before);
        }
        EXPECT_GT(aside, 0.03 * force);
        EXPECT_LT(aside, 0.09 * force);
        before = force;
      }
    }
  }
}

}  // namespace
}  // namespace touchstone::fem
