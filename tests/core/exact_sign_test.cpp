#include "core/exact_sign.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/transform.h"

namespace touchstone {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(ExactSign, KnowsTheSides) {
  const Vector3d a(0, 0, 0);
  const Vector3d b(1, 0, 0);
  const Vector3d c(0, 1, 0);
  EXPECT_EQ(side_of_plane(a, b, c, {0.2, 0.2, -1.0}), 1);
  EXPECT_EQ(side_of_plane(a, b, c, {0.2, 0.2, 1.0}), -1);
  EXPECT_EQ(side_of_plane(a, b, c, {5.0, -7.0, 0.0}), 0);
  EXPECT_EQ(side_of_line({0, 0}, {1, 0}, {0.3, 0.1}), 1);
  EXPECT_EQ(side_of_line({0, 0}, {1, 0}, {0.3, -0.1}), -1);
  EXPECT_EQ(side_of_line({0, 0}, {1, 1}, {3, 3}), 0);
}

// Points on a plane whose coordinates use all bits of a double: products need far more than 53 bits.
TEST(ExactSign, SeesTheLastBitThatRoundingHides) {
  RandomStream random(1, 0, Purpose::kTest);
  const double bit = 0x1.0p-49;  // the last bit of 12
  int hidden = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto point = [&] {
      const double x = 8.0 + std::floor(random.uniform() * 0x1.0p50) * 0x1.0p-48;  // 8 to 12 by 2^-48
      const double y = 8.0 + std::floor(random.uniform() * 0x1.0p50) * 0x1.0p-48;
      return Vector3d(x, y, (x + y) / 2.0);  // exact, on the plane z = (x + y)/2
    };
    const Vector3d a = point();
    const Vector3d b = point();
    const Vector3d c = point();
    const Vector3d d = point();
    ASSERT_EQ(side_of_plane(a, b, c, d), 0);
    const int turn = side_of_line(a.head<2>(), b.head<2>(), c.head<2>());
    ASSERT_EQ(side_of_plane(a, b, c, d - Vector3d(0, 0, bit)), turn);
    ASSERT_EQ(side_of_plane(a, b, c, d + Vector3d(0, 0, bit)), -turn);
    const double plain = (b - a).cross(c - a).dot(a - (d + Vector3d(0, 0, bit)));
    if ((plain > 0.0) - (plain < 0.0) != -turn) ++hidden;
  }
  EXPECT_GT(hidden, 0) << "the cases are too easy to tell exact from rounded";
}

TEST(ExactSign, SwappingTwoPointsChangesTheSignAlways) {
  RandomStream random(2, 0, Purpose::kTest);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Matrix3d turn = rotation_from_xyz({random.normal(), random.normal(), random.normal()});
    const auto point = [&] { return Vector3d(turn * Vector3d(random.normal(), random.normal(), 1.0)); };  // nearly flat
    const Vector3d a = point();
    const Vector3d b = point();
    const Vector3d c = point();
    const Vector3d d = point();
    const int side = side_of_plane(a, b, c, d);
    ASSERT_EQ(side_of_plane(b, a, c, d), -side);
    ASSERT_EQ(side_of_plane(a, b, d, c), -side);
    ASSERT_EQ(side_of_plane(d, b, c, a), -side);
    ASSERT_EQ(side_of_plane(b, c, a, d), side);
  }
}

TEST(ExactSign, LineIsExactToo) {
  // c is one bit off the line through a and b.
  const Vector2d a(0.5, 0.5);
  const Vector2d b(12.0, 12.0);
  const Vector2d c(24.0, 24.0);
  EXPECT_EQ(side_of_line(a, b, c), 0);
  EXPECT_EQ(side_of_line(a, b, {24.0, std::nextafter(24.0, 25.0)}), 1);
  EXPECT_EQ(side_of_line(a, b, {24.0, std::nextafter(24.0, 23.0)}), -1);
}

}  // namespace
}  // namespace touchstone
