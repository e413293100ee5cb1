#include "core/grid_places.h"

#include <gtest/gtest.h>

#include <vector>

namespace touchstone {
namespace {

struct Place {
  int i, j;
};

std::vector<Place> places_in(const std::array<Eigen::Vector2d, 3>& corner, int columns, int rows) {
  std::vector<Place> found;
  for_places_in(corner, columns, rows, [&](int i, int j, double b, double c) {
    found.push_back({i, j});
    const Eigen::Vector2d there = (1.0 - b - c) * corner[0] + b * corner[1] + c * corner[2];
    EXPECT_LT((there - Eigen::Vector2d(i, j)).norm(), 1e-12);
  });
  return found;
}

// Pick's theorem: with corners on places a triangle holds area + half of those on its rim + 1 of them.
TEST(GridPlaces, ATriangleHoldsWhatPickSays) {
  const auto found = places_in({Eigen::Vector2d(1, 1), Eigen::Vector2d(7, 3), Eigen::Vector2d(3, 9)}, 10, 10);
  // Area 22; on the rim 2 (of 6, 2), 2 (of 4, 6) and 2 (of 2, 8).
  EXPECT_EQ(found.size(), 22u + 3u + 1u);
  for (std::size_t k = 1; k < found.size(); ++k) {
    EXPECT_TRUE(found[k].j > found[k - 1].j || (found[k].j == found[k - 1].j && found[k].i > found[k - 1].i));
  }
}

TEST(GridPlaces, TheOtherSenseHoldsTheSame) {
  EXPECT_EQ(places_in({Eigen::Vector2d(3, 9), Eigen::Vector2d(7, 3), Eigen::Vector2d(1, 1)}, 10, 10).size(), 26u);
}

TEST(GridPlaces, WhatLiesBesideTheGridIsLeftOut) {
  const std::array<Eigen::Vector2d, 3> wide = {Eigen::Vector2d(-1e12, -1e12), Eigen::Vector2d(1e12, -1e12),
                                               Eigen::Vector2d(0, 1e12)};
  int count = 0;
  for_places_in(wide, 4, 3, [&](int, int, double, double) { ++count; });
  EXPECT_EQ(count, 12);
  EXPECT_TRUE(places_in({Eigen::Vector2d(10, 0), Eigen::Vector2d(12, 0), Eigen::Vector2d(10, 2)}, 10, 10).empty());
}

TEST(GridPlaces, ATriangleWithoutAreaHoldsNone) {
  EXPECT_TRUE(places_in({Eigen::Vector2d(0, 0), Eigen::Vector2d(2, 2), Eigen::Vector2d(4, 4)}, 10, 10).empty());
}

}  // namespace
}  // namespace touchstone
