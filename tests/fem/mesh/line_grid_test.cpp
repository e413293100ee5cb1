#include "fem/mesh/line_grid.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/random.h"
#include "core/units.h"
#include "fem/mesh/triangle_tree.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;

struct Soup {
  std::vector<Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// A bumpy sheet over [-5, 5]^2 on a plate of two triangles, with a needle of three long ones across it.
Soup bumpy(int n) {
  Soup soup;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double x = 10.0 * i / n - 5.0;
      const double y = 10.0 * j / n - 5.0;
      soup.vertices.emplace_back(x, y, 0.3 * std::sin(3.0 * x) * std::cos(2.0 * y));
    }
  }
  const auto at = [&](int i, int j) { return i * (n + 1) + j; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      soup.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      soup.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  const int more = static_cast<int>(soup.vertices.size());
  for (const Vector3d& v : {Vector3d(-6, -6, 2), Vector3d(6, -6, 2), Vector3d(6, 6, 2), Vector3d(-6, 6, 2),
                            Vector3d(-5.5, -5.5, -1), Vector3d(5.5, 5.4, -1), Vector3d(5.5, 5.5, -1)}) {
    soup.vertices.push_back(v);
  }
  soup.triangles.push_back({more, more + 1, more + 2});
  soup.triangles.push_back({more, more + 2, more + 3});
  soup.triangles.push_back({more + 4, more + 5, more + 6});
  return soup;
}

// The answer is the tree's, to the last bit: straight, tilted and nearly level lines, through vertices and edges, too.
TEST(LineGrid, FindsWhatTheTreeFinds) {
  for (const int n : {1, 7, 60}) {
    const Soup soup = bumpy(n);
    const TriangleTree tree(soup.vertices, soup.triangles);
    RandomStream random(7, static_cast<std::uint64_t>(n), Purpose::kTest);
    const auto uniform = [&](double low, double high) { return low + (high - low) * random.uniform(); };
    int hits = 0;
    for (const Vector3d& direction : {Vector3d(0, 0, 1), Vector3d(0, 0, -1), Vector3d(0.3, -0.2, 0.9).normalized(),
                                      Vector3d(1.0, 0.1, 0.02).normalized()}) {
      const LineGrid grid(soup.vertices, soup.triangles, direction);
      for (int k = 0; k < 4000; ++k) {
        Vector3d point(uniform(-7, 7), uniform(-7, 7), uniform(-3, 3));
        if (k % 4 == 1) point = soup.vertices[k % soup.vertices.size()] + uniform(-2, 2) * direction;
        if (k % 4 == 2) {
          const auto& t = soup.triangles[k % soup.triangles.size()];
          point = 0.5 * (soup.vertices[t[0]] + soup.vertices[t[1]]);
        }
        const auto expected = tree.first_crossing(point, direction);
        const auto found = grid.first_entry(point);
        ASSERT_EQ(found.has_value(), expected.has_value()) << point.transpose();
        ASSERT_EQ(grid.is_hit(point), expected.has_value());
        if (!found) continue;
        ASSERT_EQ(*found, expected->along) << point.transpose();
        ++hits;
      }
    }
    EXPECT_GT(hits, 4000);
  }
}

TEST(LineGrid, OfNothingHitsNothing) {
  const LineGrid grid({}, {}, Vector3d::UnitZ());
  EXPECT_FALSE(grid.first_entry(Vector3d::Zero()));
}

}  // namespace
}  // namespace touchstone::fem
