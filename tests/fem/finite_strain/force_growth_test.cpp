#include "fem/finite_strain/force_growth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/message_of.h"

namespace touchstone::fem {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

// With parts that end exactly where they should.
TEST(ForceGrowth, ComesNearTheWantedForceByFactors) {
  ForceGrowth growth(10.0);
  double now = 0.1;
  int parts = 0;
  while (const auto next = growth.next(now)) {
    EXPECT_DOUBLE_EQ(*next, 3.0 * now);
    now = *next;
    ++parts;
  }
  EXPECT_EQ(parts, 4);  // 0.3, 0.9, 2.7, 8.1
  EXPECT_LT(now, 10.0);
}

TEST(ForceGrowth, WhatIsNearOrAboveTakesNoPart) {
  EXPECT_FALSE(ForceGrowth(1.0).next(0.334));
  EXPECT_FALSE(ForceGrowth(1.0).next(1.0));
  EXPECT_FALSE(ForceGrowth(1.0).next(5.0));
}

// No factor leads from such a force to the wanted one: a loop that multiplies has no end.
TEST(ForceGrowth, AForceThatIsntAboveZeroIsAnError) {
  for (const double now : {0.0, -0.0, -1e-9, -2.0}) {
    EXPECT_THAT(message_of([&] { ForceGrowth(1.5).next(now); }),
                AllOf(HasSubstr("1.5 N is wanted"), HasSubstr("must be above 0")))
        << now;
  }
  EXPECT_THAT(message_of([] { ForceGrowth(-1.0).next(-5.0); }), HasSubstr("must be above 0"));
}

TEST(ForceGrowth, AForceThatDoesntGrowIsAnError) {
  ForceGrowth growth(100.0);
  EXPECT_TRUE(growth.next(0.5));
  EXPECT_TRUE(growth.next(0.6));  // slower than wanted, but onwards
  EXPECT_THAT(message_of([&] { growth.next(0.6); }), AllOf(HasSubstr("doesn't grow"), HasSubstr("0.6 N")));
}

}  // namespace
}  // namespace touchstone::fem
