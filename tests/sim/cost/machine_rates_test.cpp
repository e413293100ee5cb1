#include "sim/cost/machine_rates.h"

#include <gtest/gtest.h>

#include "core/whole_file.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

void expect_equal(const MachineRates& one, const MachineRates& other) {
  EXPECT_EQ(one.threads, other.threads);
  EXPECT_EQ(one.elimination_s, other.elimination_s);
  EXPECT_EQ(one.unknown_s, other.unknown_s);
  EXPECT_EQ(one.flat_press_s, other.flat_press_s);
  EXPECT_EQ(one.curved_press_s, other.curved_press_s);
  EXPECT_EQ(one.newton_s, other.newton_s);
  EXPECT_EQ(one.speed_up, other.speed_up);
}

// Two measurements never agree to the last digit: equal rates were kept.
TEST(MachineRates, AreMeasuredOnceAndAnewWhereTheFileIsDamaged) {
  const test::TemporaryFolder cache;
  const MachineRates first = machine_rates(1, cache.path());
  EXPECT_EQ(first.threads, 1);
  EXPECT_EQ(first.speed_up, 1.0);
  EXPECT_GT(first.elimination_s, 0.0);
  EXPECT_GT(first.newton_s, first.elimination_s) << "a Newton iterate does more for an operation";
  expect_equal(machine_rates(1, cache.path()), first);

  const std::filesystem::path file = rates_file(1, cache.path());
  const std::string whole = read_whole_file(file);
  std::string faster = whole;
  faster.replace(faster.find("\"elimination_s\": ") + 17, 1, "-");
  write_whole_file(file, faster);
  const MachineRates again = machine_rates(1, cache.path());
  EXPECT_GT(again.elimination_s, 0.0);
  expect_equal(machine_rates(1, cache.path()), again);
}

TEST(MachineRates, AreOfOneNumberOfThreads) {
  const test::TemporaryFolder cache;
  EXPECT_NE(rates_key(1), rates_key(2));
  EXPECT_NE(rates_file(1, cache.path()), rates_file(2, cache.path()));
}

}  // namespace
}  // namespace touchstone::sim
