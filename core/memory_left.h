#pragma once
// Memory is asked for before large work begins: a process that runs out of it in the middle is ended without a word, or
// waits for ever (OpenBLAS does, for its buffers).

#include <filesystem>
#include <string>
#include <string_view>

namespace touchstone {

/// Bytes that this process may still take, and what says so: "the address space (ulimit -v)".
struct MemoryLeft {
  double bytes = 0.0;
  std::string by;
};

/// The least that one of these leaves: limits of this process (RLIMIT_AS, RLIMIT_DATA), of its control group and the
/// groups around it (versions 1 and 2), and the machine's memory that isn't used. Infinite where none is known.
MemoryLeft memory_left();

/// What a control group and those around it leave. `mount` is where the hierarchy is, `group` the path of the process'
/// own in it, as /proc/self/cgroup has it; in a container that path may not be there, and the mount is the group.
MemoryLeft memory_left_of_group(const std::filesystem::path& mount, const std::filesystem::path& group);

/// Bytes of address space that this process may still take by RLIMIT_AS; infinite without that limit.
double address_space_left();

/// @throws Error "<what> needs about 776 MB of memory; 300 MB are left by the address space (ulimit -v)" if less than
/// these bytes are left
void require_memory(double bytes, std::string_view what);

}  // namespace touchstone
