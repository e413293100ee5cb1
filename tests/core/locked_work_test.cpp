#include "core/locked_work.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "core/error.h"

namespace touchstone {
namespace {

using namespace std::chrono_literals;

constexpr auto kLongestWait = 60s;        // for a thread of a busy machine
constexpr auto kTimeForAMistake = 300ms;  // a waiting thread takes a task within microseconds

bool comes_true(const std::atomic<bool>& flag, std::chrono::milliseconds within) {
  const auto end = std::chrono::steady_clock::now() + within;
  while (!flag && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  return flag;
}

/// Whether a thread that waits for a part of `locked`'s work begins a task that doesn't belong to it. `locked` calls
/// the work it is given, under a lock. The other task would ask for the same lock, which is a hang; here it only says
/// who runs it. The part waits so long for the other task to begin.
bool takes_other_tasks(std::chrono::milliseconds part_waits,
                       const std::function<void(const std::function<void()>&)>& locked) {
  const tbb::global_control two(tbb::global_control::max_allowed_parallelism, 2);
  const std::thread::id holder = std::this_thread::get_id();
  std::atomic<bool> held{false};
  std::atomic<bool> helped{false};
  std::atomic<bool> taken{false};
  std::atomic<bool> other_run{false};
  bool queued = false;
  tbb::task_arena arena(2, 1);
  arena.execute([&] {
    locked([&] {
      held = true;
      tbb::task_group parts;
      parts.run([&] {  // on the arena's other thread, as the holder takes no task before `helped`
        helped = true;
        comes_true(other_run, part_waits);
      });
      if (comes_true(helped, kLongestWait)) {
        queued = true;
        arena.enqueue([&] {
          taken = held && std::this_thread::get_id() == holder;
          other_run = true;
        });
      }
      parts.wait();
      held = false;
    });
  });
  EXPECT_TRUE(queued) << "no second thread came";
  if (queued) {
    EXPECT_TRUE(comes_true(other_run, kLongestWait)) << "the other task was lost";
  }
  return taken;
}

// That there is something to be isolated from: under a plain lock a waiting thread does take another's task.
TEST(LockedWork, APlainLockLetsItsThreadTakeOtherTasks) {
  std::mutex mutex;
  EXPECT_TRUE(takes_other_tasks(kLongestWait, [&](const auto& work) {
    const std::lock_guard lock(mutex);
    work();
  }));
}

TEST(LockedWork, AThreadThatHoldsTheLockTakesNoOtherTask) {
  std::mutex mutex;
  EXPECT_FALSE(takes_other_tasks(kTimeForAMistake, [&](const auto& work) { locked_work(mutex, work); }));
}

TEST(LockedWork, AThreadThatWorksOnceTakesNoOtherTask) {
  std::once_flag flag;
  EXPECT_FALSE(takes_other_tasks(kTimeForAMistake, [&](const auto& work) { work_once(flag, work); }));
}

// A loop whose steps take one lock over loops of their own comes to its end, and no two steps hold it at once.
TEST(LockedWork, LoopsUnderOneLockInALoopComeToTheirEnd) {
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  std::mutex mutex;
  int inside = 0;
  std::atomic<int> parts{0};
  tbb::parallel_for(0, 40, [&](int) {
    locked_work(mutex, [&] {
      EXPECT_EQ(++inside, 1);
      tbb::parallel_for(0, 40, [&](int) {
        std::this_thread::yield();
        ++parts;
      });
      --inside;
    });
  });
  EXPECT_EQ(parts, 1600);
}

TEST(LockedWork, WhatTheWorkThrowsComesOutAndLeavesTheLockFree) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "ThreadSanitizer's pthread_once waits for ever after an exception (gcc 12)";
#endif
  std::mutex mutex;
  EXPECT_THROW(locked_work(mutex, [] { fail("broke"); }), Error);
  EXPECT_EQ(locked_work(mutex, [] { return 7; }), 7);
  std::once_flag flag;
  EXPECT_THROW(work_once(flag, [] { fail("broke"); }), Error);
  int calls = 0;
  work_once(flag, [&] { ++calls; });
  work_once(flag, [&] { ++calls; });
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace touchstone
