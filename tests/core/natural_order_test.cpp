#include "core/natural_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace touchstone {
namespace {

TEST(NaturalOrder, RunsOfDigitsGoByTheirValue) {
  const std::vector<std::string> wanted = {"",
                                           "0",
                                           "1",
                                           "2",
                                           "02b",
                                           "10",
                                           "010a",
                                           "11",
                                           "99999999999999999999999998",
                                           "99999999999999999999999999",
                                           "100000000000000000000000000",
                                           "a",
                                           "a1b2",
                                           "a1b10",
                                           "a2b1",
                                           "frame_2",
                                           "frame_10",
                                           "\xc3\xa9"};
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    for (std::size_t j = 0; j < wanted.size(); ++j) {
      EXPECT_EQ(natural_less(wanted[i], wanted[j]), i < j) << wanted[i] << " " << wanted[j];
    }
  }
  std::vector<std::string> numbers;
  for (int i = 0; i < 120; ++i) numbers.push_back("p" + std::to_string(i));
  std::vector<std::string> sorted = numbers;
  std::sort(sorted.begin(), sorted.end());
  ASSERT_NE(sorted, numbers);
  std::sort(sorted.begin(), sorted.end(), natural_less);
  EXPECT_EQ(sorted, numbers);
}

TEST(NaturalOrder, NamesOfEqualValueHaveAnOrder) {
  EXPECT_TRUE(natural_less("01", "1") != natural_less("1", "01"));
  EXPECT_FALSE(natural_less("01", "01"));
}

}  // namespace
}  // namespace touchstone
