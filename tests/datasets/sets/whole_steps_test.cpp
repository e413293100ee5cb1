#include "datasets/sets/whole_steps.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

namespace touchstone::datasets {
namespace {

TEST(WholeSteps, AreAllDone) {
  std::vector<std::atomic<int>> done(1000);
  for_each_whole(done.size(), [&](std::size_t i) { ++done[i]; });
  for (const auto& one : done) EXPECT_EQ(one, 1);
  for_each_whole(0, [](std::size_t) { FAIL(); });
}

/// The first step to begin has a loop of its own under way when another one throws. TBB alone would cut that loop
/// short.
TEST(WholeSteps, AStepAtWorkIsDoneWholeThoughAnotherOneThrows) {
  constexpr int kInner = 2000;
  tbb::task_arena arena(4, 4);  // several at once on any machine
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> begun{0}, inner{0}, whole{0}, thrown{0};
    const auto run = [&] {
      for_each_whole(64, [&](std::size_t) {
        if (begun++ == 0) {
          tbb::parallel_for(0, kInner, [&](int) {
            ++inner;
            std::this_thread::yield();
          });
          ++whole;
          return;
        }
        while (inner == 0) std::this_thread::yield();
        ++thrown;
        throw std::runtime_error("enough");
      });
    };
    EXPECT_THROW(arena.execute(run), std::runtime_error);
    EXPECT_EQ(whole, 1);
    EXPECT_EQ(inner, kInner);
    EXPECT_GE(thrown, 1);
  }
}

TEST(WholeSteps, NoMoreAreBegunAfterAnException) {
  std::atomic<int> begun{0};
  tbb::task_arena one_thread(1);
  EXPECT_THROW(one_thread.execute([&] {
    for_each_whole(100, [&](std::size_t) {
      if (++begun == 3) throw std::runtime_error("enough");
    });
  }),
               std::runtime_error);
  EXPECT_EQ(begun, 3);
}

}  // namespace
}  // namespace touchstone::datasets
