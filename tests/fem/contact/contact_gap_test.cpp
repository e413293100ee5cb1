#include "fem/contact/contact_gap.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/units.h"
#include "tests/support/half_space_gel.h"

namespace touchstone::fem {
namespace {

Compliance flat_gel(double half_width, double spacing) {
  return test::half_space_gel(half_width, spacing, {1.0, 0.3}, 10.0);
}

RigidTransform at(double x, double y, double z) {
  return {Eigen::Matrix3d::Identity(), {x, y, z}};
}

TEST(WeightedGap, OfALargeFlatFaceIsTheWeightTimesTheGap) {
  const Compliance gel = flat_gel(2.0, 0.5);
  const ContactSurface surface(gel);
  const WeightedGap gap = weighted_gap(surface, BoxShape{{10, 10, 1}}, at(0, 0, 0.5 - 0.2), {});
  EXPECT_NEAR(gap.deepest, -0.2, 1e-15);
  for (Eigen::Index i = 0; i < gap.weighted.size(); ++i) {
    EXPECT_NEAR(gap.weighted[i], -0.2 * surface.weight[i], 1e-15);
    EXPECT_NEAR(gap.lowest[i], -0.2, 1e-15);
  }
}

TEST(WeightedGap, OfASphereIsItsQuadraticGapExactly) {
  // Far inside its radius a sphere's gap is r^2/(2R) + ..., and against hats the rule of degree 5 is exact for the
  // square.
  const Compliance gel = flat_gel(1.0, 0.25);
  const ContactSurface surface(gel);
  const double radius = 1000.0;
  const WeightedGap gap = weighted_gap(surface, SphereShape{radius}, at(0, 0, radius - 0.001), {});
  for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
    // int phi r^2 over the triangles around v: exact moments of hats by the mass matrix.
    double moment = 0.0;
    for (const auto& t : gel.triangles) {
      for (int k = 0; k < 3; ++k) {
        if (t[k] != static_cast<int>(v)) continue;
        const double area = 0.5 * 0.25 * 0.25;
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b < 3; ++b) {
            // int phi_k phi_a phi_b = 2A a!b!c!/(a+b+c+2)!
            int power[3] = {0, 0, 0};
            ++power[k], ++power[a], ++power[b];
            const double factorial[4] = {1, 1, 2, 6};
            const double integral =
                2.0 * area * factorial[power[0]] * factorial[power[1]] * factorial[power[2]] / 120.0;
            moment += integral * gel.vertices[t[a]].dot(gel.vertices[t[b]]);
          }
        }
      }
    }
    const double wanted = moment / (2.0 * radius) - 0.001 * surface.weight[static_cast<Eigen::Index>(v)];
    EXPECT_NEAR(gap.weighted[static_cast<Eigen::Index>(v)], wanted, 1e-10);
  }
}

TEST(WeightedGap, MovesContinuouslyWithASharpPunch) {
  const Compliance gel = flat_gel(2.0, 0.5);
  const ContactSurface surface(gel);
  const RoundedCylinder punch{1.1, 0.0, 1.0};
  const WeightedGap here = weighted_gap(surface, punch, at(0.0123, 0.0345, -0.1), {});
  const WeightedGap there = weighted_gap(surface, punch, at(0.0123 + 1e-9, 0.0345, -0.1), {});
  int finite = 0;
  for (Eigen::Index i = 0; i < here.weighted.size(); ++i) {
    ASSERT_EQ(std::isfinite(here.weighted[i]), std::isfinite(there.weighted[i]));
    if (!std::isfinite(here.weighted[i])) continue;
    ++finite;
    EXPECT_NEAR(here.weighted[i], there.weighted[i], 1e-8);
  }
  EXPECT_GT(finite, 10);
}

TEST(WeightedGap, CoversThePunchOnAverage) {
  // Vertices whose gap is the plain depth carry the punch: their weights sum to its area, on average over positions.
  const Compliance gel = flat_gel(3.0, 0.25);
  const ContactSurface surface(gel);
  const RoundedCylinder punch{1.5, 0.0, 1.0};
  double area = 0.0;
  const int positions = 40;
  for (int k = 0; k < positions; ++k) {
    const WeightedGap gap =
        weighted_gap(surface, punch, at(0.25 * k / positions, 0.25 * std::fmod(k * 0.618, 1.0), -0.1), {});
    for (Eigen::Index i = 0; i < gap.weighted.size(); ++i) {
      if (std::isfinite(gap.weighted[i]) && gap.weighted[i] < -0.05 * surface.weight[i]) area += surface.weight[i];
    }
  }
  EXPECT_NEAR(area / positions, kPi * 1.5 * 1.5, 0.03 * kPi * 1.5 * 1.5);
}

TEST(WeightedGap, SeesANeedleBetweenItsPoints) {
  const Compliance gel = flat_gel(2.0, 1.0);
  const ContactSurface surface(gel);
  for (int k = 0; k < 20; ++k) {
    const WeightedGap gap = weighted_gap(surface, RoundedCylinder{0.2, 0.05, 0.3}, at(0.05 * k, 0.031 * k, -0.1), {});
    EXPECT_NEAR(gap.deepest, -0.1, 1e-12) << k;
  }
}

TEST(WeightedGap, FollowsTheGelsTangentialDisplacement) {
  const Compliance gel = flat_gel(1.0, 0.25);
  const ContactSurface surface(gel);
  const SphereShape sphere{5.0};
  PatchMotion carried;
  carried.translation = {0.3, -0.2, 0.7};  // its normal part is ignored
  const WeightedGap moved = weighted_gap(surface, sphere, at(0.3, -0.2, 4.9), carried);
  const WeightedGap rest = weighted_gap(surface, sphere, at(0, 0, 4.9), {});
  for (Eigen::Index i = 0; i < rest.weighted.size(); ++i) EXPECT_NEAR(moved.weighted[i], rest.weighted[i], 1e-14);
}

TEST(WeightedGap, OfAPunchTiltedALittleIsThatOfTheStraightOne) {
  // A sharp punch that leans by half a milliradian shows its side, three millimetres high, as a rim of 1.5 micrometres.
  const Compliance gel = flat_gel(2.0, 0.25);
  const ContactSurface surface(gel);
  const RoundedCylinder punch{1.1, 0.0, 3.0};
  const WeightedGap straight = weighted_gap(surface, punch, at(0.01, 0.02, -0.1));
  RigidTransform leaning = at(0.01, 0.02, -0.1);
  leaning.rotation = rotation_from_xyz({5e-4, 0.0, 0.0});
  const WeightedGap tilted = weighted_gap(surface, punch, leaning);
  for (Eigen::Index i = 0; i < straight.weighted.size(); ++i) {
    if (!std::isfinite(straight.weighted[i])) continue;
    EXPECT_NEAR(tilted.weighted[i] / surface.weight[i], straight.weighted[i] / surface.weight[i], 0.005);
  }
}

TEST(WeightedGap, IsFarWhereTheLinesMiss) {
  const Compliance gel = flat_gel(1.0, 0.25);
  const ContactSurface surface(gel);
  const WeightedGap gap = weighted_gap(surface, SphereShape{1.0}, at(50, 0, 0), {});
  EXPECT_TRUE(std::isinf(gap.deepest));
  for (Eigen::Index i = 0; i < gap.weighted.size(); ++i) EXPECT_TRUE(std::isinf(gap.weighted[i]));
}

TEST(WeightedGap, OfACurvedGelIsThatOfItsSphereNotOfItsTriangles) {
  // Triangles of 1 mm on a sphere of 10 mm lie up to 25 um below it, 10 to 15 on the mean over a hat.
  constexpr double kRadius = 10.0;
  constexpr double kHigh = 0.1;  // of a flat face above the sphere
  std::vector<Eigen::Vector3d> places;
  std::vector<std::array<int, 3>> faces;
  constexpr int kSide = 5;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      places.push_back(kRadius * Eigen::Vector3d(i - 2.0, j - 2.0, kRadius).normalized());
      if (i + 1 == kSide || j + 1 == kSide) continue;
      const int v = i * kSide + j;
      faces.push_back({v, v + kSide, v + kSide + 1});
      faces.push_back({v, v + kSide + 1, v + 1});
    }
  }
  const ContactSurface surface(places, faces, test::surface_mass(places, faces), kRadius);
  const BoxShape face{{40, 40, 1}};
  const RigidTransform pose = at(0, 0, kRadius + kHigh + 0.5);
  const WeightedGap curved = weighted_gap(surface, face, pose, {}, {}, true);
  const WeightedGap flat = weighted_gap(surface, face, pose, {}, {}, false);
  const int middle = kSide * kSide / 2;
  double wanted = 0.0;
  constexpr int kCells = 60;
  for (const int t : surface.triangles_of[middle]) {
    const auto& corners = surface.triangles[t];
    for (int i = 0; i < kCells; ++i) {
      for (int j = 0; i + j < kCells; ++j) {
        const Eigen::Vector3d b(i + 1.0 / 3.0, j + 1.0 / 3.0, kCells - i - j - 2.0 / 3.0);
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
        double hat = 0.0;
        for (int k = 0; k < 3; ++k) {
          point += b[k] / kCells * surface.vertices[corners[k]];
          if (corners[k] == middle) hat = b[k] / kCells;
        }
        const double gap = (kRadius + kHigh) * point.norm() / point.z() - kRadius;
        const double twice = i + j + 1 < kCells ? 2.0 : 1.0;  // for the cell that stands on its head
        wanted += twice * hat * gap * surface.triangle_area[t] / (kCells * kCells);
      }
    }
  }
  wanted /= surface.weight[middle];
  EXPECT_NEAR(curved.plain[middle] / surface.weight[middle], wanted, 5e-4);
  EXPECT_GT(flat.plain[middle] / surface.weight[middle], wanted + 0.01);
  EXPECT_NEAR(curved.deepest, kHigh, 5e-4);
}

TEST(DeepestGap, IsThatOfTheWholeGapOverAndUnderTheSurface) {
  const Compliance gel = flat_gel(2.0, 0.25);
  const ContactSurface surface(gel);
  const std::vector<ContactShape> shapes{SphereShape{0.9}, RoundedCylinder{0.8, 0.05, 3.0},
                                         RoundedCylinder{0.1, 0.0, 3.0}, BoxShape{{1.1, 0.7, 0.5}}};
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    for (const double z : {0.2, 0.8, 1.7}) {
      RigidTransform pose = at(0.13, -0.21, z);
      pose.rotation = rotation_from_xyz({0.07, -0.03, 0.4});
      for (const bool cut : {false, true}) {
        const double wanted = weighted_gap(surface, shapes[k], pose, {}, {}, cut).deepest;
        EXPECT_EQ(deepest_gap(surface, shapes[k], pose, cut), wanted) << k << " at " << z;
        EXPECT_TRUE(std::isfinite(wanted));
      }
    }
  }
  EXPECT_TRUE(std::isinf(deepest_gap(surface, shapes.front(), at(50, 0, 0))));
}

TEST(WeightedGap, LeavesOutOnlyWhatIsAboveItsReach) {
  const Compliance gel = flat_gel(2.0, 0.25);
  const ContactSurface surface(gel);
  const SphereShape sphere{4.0};
  const WeightedGap all = weighted_gap(surface, sphere, at(0, 0, 3.9));
  const WeightedGap near = weighted_gap(surface, sphere, at(0, 0, 3.9), {}, {0.0, 0.5});
  int left_out = 0;
  for (Eigen::Index i = 0; i < all.weighted.size(); ++i) {
    if (std::isfinite(near.weighted[i])) {
      EXPECT_EQ(near.weighted[i], all.weighted[i]);
    } else {
      ++left_out;
      EXPECT_GT(all.weighted[i] / surface.weight[i], 0.05);
    }
  }
  EXPECT_GT(left_out, 20);
}

TEST(WeightedGap, MovedAlongTheNormalIsThatOfTheMovedBody) {
  const Compliance gel = flat_gel(2.0, 0.25);
  const ContactSurface surface(gel);
  for (const ContactShape& shape : {ContactShape(RoundedCylinder{1.1, 0.2, 1.0}), ContactShape(SphereShape{3.0})}) {
    const double bottom = bounding_ball(shape).centre.z() == 0.0 ? 3.0 : 0.0;
    WeightedGap moved = weighted_gap(surface, shape, at(0.01, 0.02, bottom - 0.1));
    moved.move_along_normals(surface.weight, -0.15);
    const WeightedGap there = weighted_gap(surface, shape, at(0.01, 0.02, bottom - 0.25));
    EXPECT_NEAR(moved.deepest, there.deepest, 1e-14);
    for (Eigen::Index i = 0; i < there.weighted.size(); ++i) {
      if (std::isinf(there.weighted[i])) {
        EXPECT_TRUE(std::isinf(moved.weighted[i]));
      } else {
        EXPECT_NEAR(moved.weighted[i], there.weighted[i], 1e-14);
        EXPECT_NEAR(moved.lowest[i], there.lowest[i], 1e-14);
      }
    }
  }
}

TEST(SilhouetteDistance, HasTheSignOfAHitAndNeverExceedsTheDistance) {
  // The same outline by two methods: the sign of the distance, and whether the line enters; upright, tilted, from below
  // and lying. Between two lines it may change by their distance at most.
  const auto relief = std::make_shared<const ReliefMap>(2, 2, Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(1, 1),
                                                        std::array{true, true}, std::vector<float>(4, 0.01F));
  const std::vector<ContactShape> shapes{
      RoundedCylinder{1.1, 0.2, 1.0}, RoundedCylinder{1.1, 0.0, 1.0},
      RoundedCylinder{0.8, 0.8, 1.6}, SphereShape{0.9},
      BoxShape{{1.0, 1.8, 0.5}},      ReliefShape{RoundedCylinder{1.1, 0.2, 1.0}, relief}};
  const std::vector<Eigen::Vector3d> directions{{0, 0, 1},      {1e-9, 0, 1},     {0.1, 0.05, 1},  {-0.3, 0.2, 1},
                                                {0.9, -1.4, 1}, {0.2, 0.1, -1.0}, {1, 0.3, 0.002}, {0.5, 0, 0.5}};
  for (const ContactShape& shape : shapes) {
    for (const Eigen::Vector3d& direction : directions) {
      const Eigen::Vector3d d = direction.normalized();
      if (std::holds_alternative<BoxShape>(shape) && direction.head<2>() != Eigen::Vector2d::Zero()) {
        EXPECT_FALSE(silhouette_distance(std::get<BoxShape>(shape), Eigen::Vector3d::Zero(), d).has_value());
        continue;
      }
      const Eigen::Vector3d a = d.unitOrthogonal();
      const Eigen::Vector3d b = d.cross(a);
      Eigen::Vector3d before = Eigen::Vector3d::Zero();
      double value_before = 0.0;
      int hits = 0;
      for (int k = 0; k < 4000; ++k) {
        const double x = std::fmod(0.618034 * k, 3.6) - 1.8;
        const double y = std::fmod(0.754878 * k, 3.6) - 1.8;
        const Eigen::Vector3d point = x * a + y * b - 2.0 * d;
        const auto value = std::visit([&](const auto& body) { return silhouette_distance(body, point, d); }, shape);
        ASSERT_TRUE(value.has_value());
        const bool hit = first_entry(shape, point, d).has_value();
        hits += hit;
        if (std::abs(*value) > 1e-12) {
          EXPECT_EQ(*value > 0.0, hit) << "shape " << &shape - shapes.data() << ": " << *value << " at " << x << ", "
                                       << y << " along " << d.transpose();
        }
        if (k > 0) {
          EXPECT_LE(std::abs(*value - value_before), (point - before).norm() * (1.0 + 1e-12));
        }
        before = point;
        value_before = *value;
      }
      EXPECT_GT(hits, 200);
      EXPECT_LT(hits, 3800);
    }
  }
}

}  // namespace
}  // namespace touchstone::fem
