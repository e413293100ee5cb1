#include "core/memory_left.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

TEST(MemoryLeft, TheMachineHasSome) {
  EXPECT_GT(memory_left().bytes, 1e6);
  EXPECT_NO_THROW(require_memory(1e6, "this"));
}

TEST(MemoryLeft, MoreThanThereIsIsRefusedByWhatLeavesIt) {
  const std::string message = test::message_of([] { require_memory(1e18, "a gel"); });
  EXPECT_NE(message.find("a gel needs about 1000000000000 MB of memory; "), std::string::npos) << message;
  EXPECT_NE(message.find(" are left by the "), std::string::npos) << message;
}

TEST(MemoryLeft, TheTightestOfTheGroupsCounts) {
  const test::TemporaryFolder folder;
  folder.write("memory.max", "5000000\n");
  folder.write("memory.current", "4000000\n");
  folder.write("own/memory.max", "max\n");
  folder.write("own/memory.current", "3000000\n");
  EXPECT_EQ(memory_left_of_group(folder.path(), "/own").bytes, 1e6);
  EXPECT_EQ(memory_left_of_group(folder.path(), "/of another namespace").bytes, 1e6);
  folder.write("own/memory.max", "3500000\n");
  EXPECT_EQ(memory_left_of_group(folder.path(), "/own").bytes, 5e5);
  folder.write("own/memory.stat", "anon 1\ninactive_file 200000\n");
  EXPECT_EQ(memory_left_of_group(folder.path(), "/own").bytes, 7e5);
}

TEST(MemoryLeft, GroupsOfVersionOneCountAsWell) {
  const test::TemporaryFolder folder;
  folder.write("own/memory.limit_in_bytes", "3000000\n");
  folder.write("own/memory.usage_in_bytes", "1000000\n");
  EXPECT_EQ(memory_left_of_group(folder.path(), "/own").bytes, 2e6);
  EXPECT_TRUE(std::isinf(memory_left_of_group(folder.path(), "/").bytes));
}

}  // namespace
}  // namespace touchstone
