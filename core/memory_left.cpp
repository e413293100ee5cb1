#include "core/memory_left.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>

#include "core/error.h"

namespace touchstone {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kMegabyte = 1e6;

/// The number that a file of one number holds; infinite if there's no such file, or it holds none ("max").
double number_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  double value = 0.0;
  return in >> value ? value : kInfinite;
}

/// The number behind a name at the start of a line, 0 where there is none.
double named_number_in(const std::filesystem::path& file, std::string_view name) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string first;
    double value = 0.0;
    if (words >> first >> value && first == name) return value;
  }
  return 0.0;
}

/// Pages of this process: of all address space, and of data and stacks.
struct OwnBytes {
  double address_space = 0.0;
  double data = 0.0;
};

OwnBytes own_bytes() {
  std::ifstream in("/proc/self/statm");
  std::array<double, 6> pages{};  // size, resident, shared, text, library, data
  for (double& value : pages) in >> value;
  if (!in) return {};
  const auto page = static_cast<double>(sysconf(_SC_PAGESIZE));
  return {page * pages[0], page * pages[5]};
}

double limit_of(__rlimit_resource which) {
  rlimit limit{};
  if (getrlimit(which, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kInfinite;
  return static_cast<double>(limit.rlim_cur);
}

void note(MemoryLeft& least, double bytes, const char* by) {
  if (bytes < least.bytes) least = {std::max(0.0, bytes), by};
}

/// Where the hierarchies of control groups are mounted.
struct Hierarchy {
  const char* controllers;  // as /proc/self/cgroup names them
  const char* mount;
};
constexpr std::array<Hierarchy, 2> kHierarchies{{{"", "/sys/fs/cgroup"}, {"memory", "/sys/fs/cgroup/memory"}}};

}  // namespace

MemoryLeft memory_left_of_group(const std::filesystem::path& mount, const std::filesystem::path& group) {
  MemoryLeft least{kInfinite, {}};
  std::error_code ignored;
  std::filesystem::path at = mount / group.relative_path();
  if (!std::filesystem::is_directory(at, ignored)) at = mount;
  for (;; at = at.parent_path()) {
    // What its files are kept in memory for is given back when it's wanted.
    const double two = number_in(at / "memory.max") - number_in(at / "memory.current") +
                       named_number_in(at / "memory.stat", "inactive_file");
    const double one = number_in(at / "memory.limit_in_bytes") - number_in(at / "memory.usage_in_bytes") +
                       named_number_in(at / "memory.stat", "total_inactive_file");
    for (const double left : {two, one}) {  // not a number where there are no such files
      if (std::isfinite(left)) note(least, left, "the control group's memory");
    }
    if (at == mount || !at.has_relative_path()) return least;
  }
}

double address_space_left() {
  const double limit = limit_of(RLIMIT_AS);
  return std::isfinite(limit) ? std::max(0.0, limit - own_bytes().address_space) : kInfinite;
}

MemoryLeft memory_left() {
  MemoryLeft least{kInfinite, {}};
  note(least, address_space_left(), "the address space (ulimit -v)");
  note(least, limit_of(RLIMIT_DATA) - own_bytes().data, "the process' data (ulimit -d)");
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // "4:memory:/path"; of version 2 "0::/path"
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    for (const Hierarchy& hierarchy : kHierarchies) {
      if (line.substr(first + 1, second - first - 1) != hierarchy.controllers) continue;
      const MemoryLeft left = memory_left_of_group(hierarchy.mount, line.substr(second + 1));
      note(least, left.bytes, left.by.c_str());
    }
  }
  constexpr double kKibibyte = 1024.0;
  const double available = kKibibyte * named_number_in("/proc/meminfo", "MemAvailable:");
  const double swap = kKibibyte * named_number_in("/proc/meminfo", "SwapFree:");
  if (available > 0.0) note(least, available + swap, "the machine's memory");
  return least;
}

void require_memory(double bytes, std::string_view what) {
  const MemoryLeft left = memory_left();
  if (bytes <= left.bytes) return;
  fail("{} needs about {:.0f} MB of memory; {:.0f} MB are left by {}", what, bytes / kMegabyte, left.bytes / kMegabyte,
       left.by);
}

}  // namespace touchstone
