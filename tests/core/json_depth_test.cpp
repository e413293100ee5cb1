#include "core/json_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace touchstone {
namespace {

TEST(JsonDepth, CountsWhatIsOpenAtOnce) {
  EXPECT_EQ(deepest_json(""), 0);
  EXPECT_EQ(deepest_json("1"), 0);
  EXPECT_EQ(deepest_json("{}"), 1);
  EXPECT_EQ(deepest_json(R"([[], {"a": [1]}, [2]])"), 3);
  EXPECT_EQ(deepest_json(std::string(100000, '[')), 100000);
}

TEST(JsonDepth, TakesNoBracketOfAString) {
  EXPECT_EQ(deepest_json(R"(["[[[{"])"), 1);
  EXPECT_EQ(deepest_json(R"(["\"[[", "\\", [1]])"), 2);
  EXPECT_EQ(deepest_json(R"("\)"), 0);  // broken off within an escape
}

}  // namespace
}  // namespace touchstone
