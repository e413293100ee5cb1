#include "lab/statistics/straight_line.h"

#include <gtest/gtest.h>

#include <array>

namespace touchstone::lab {
namespace {

TEST(StraightLine, FindsTheLineThatItsPointsLieOn) {
  const StraightLine line = line_through(std::array{-1.0, 0.5, 4.0}, std::array{5.0, 2.0, -5.0});
  EXPECT_NEAR(line.slope, -2.0, 1e-14);
  EXPECT_NEAR(line.offset, 3.0, 1e-14);
  EXPECT_NEAR(line.r2, 1.0, 1e-14);
}

// Anscombe's first set and its line [Anscombe1973]: y = 3 + 0.5 x, r2 = 0.667.
TEST(StraightLine, AnscombesFirstSet) {
  const StraightLine line = line_through(std::array{10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0},
                                         std::array{8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68});
  EXPECT_NEAR(line.slope, 0.5, 5e-4);
  EXPECT_NEAR(line.offset, 3.0, 5e-3);
  EXPECT_NEAR(line.r2, 0.667, 1e-3);
}

TEST(StraightLine, ExplainsNothingWhereNothingChanges) {
  const StraightLine line = line_through(std::array{1.0, 2.0, 3.0}, std::array{0.5, 0.5, 0.5});
  EXPECT_EQ(line.slope, 0.0);
  EXPECT_EQ(line.offset, 0.5);
  EXPECT_EQ(line.r2, 0.0);
}

}  // namespace
}  // namespace touchstone::lab
