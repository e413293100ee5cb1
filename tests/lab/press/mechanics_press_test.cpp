#include "lab/press/mechanics_press.h"

#include <gtest/gtest.h>

namespace touchstone::lab {
namespace {

TEST(Extrapolated, TakesAnErrorOfFirstOrderAway) {
  const auto force = [](double edge) { return 3.0 + 0.7 * edge; };
  EXPECT_NEAR(extrapolated({force(0.4), force(0.2)}), 3.0, 1e-15);
  EXPECT_EQ(extrapolated({force(0.4)}), force(0.4));
}

TEST(RelativeError, HasNoSign) {
  EXPECT_NEAR(relative_error(0.9, 1.0), 0.1, 1e-15);
  EXPECT_NEAR(relative_error(-1.1, -1.0), 0.1, 1e-15);
}

}  // namespace
}  // namespace touchstone::lab
