#pragma once
// Locks that are held while loops run in parallel. A thread that waits for the rest of its loop takes other tasks
// meanwhile: of another scene, say, which asks for the same lock. It would wait for itself for ever. So work under a
// lock is isolated: until it's done, its threads take tasks of this work alone (docs/decisions/data.md, "What may a
// thread do that holds a lock?"). Who includes this links oneTBB.

#include <tbb/task_arena.h>

#include <mutex>

namespace touchstone {

/// What `work()` returns (no reference), done with `mutex` held. Its parallel loops take no other tasks meanwhile.
template <typename Mutex, typename Work>
auto locked_work(Mutex& mutex, const Work& work) {
  const std::lock_guard lock(mutex);
  return tbb::this_task_arena::isolate(work);
}

/// std::call_once for `work` with parallel loops, which take no other tasks meanwhile.
template <typename Work>
void work_once(std::once_flag& flag, const Work& work) {
  std::call_once(flag, [&] { tbb::this_task_arena::isolate(work); });
}

}  // namespace touchstone
