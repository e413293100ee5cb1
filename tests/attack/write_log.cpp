// Preloaded into the program: writes each file that is brought to the disk, and each renaming, into the file that
// TOUCHSTONE_WRITE_LOG names, in their order.
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

void log(const std::string& line) {
  const char* const file = std::getenv("TOUCHSTONE_WRITE_LOG");
  const int descriptor = file != nullptr ? open(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600) : -1;
  if (descriptor < 0) return;
  if (write(descriptor, line.data(), line.size()) < 0) std::abort();
  close(descriptor);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) int fsync(int descriptor) {
  const auto real = reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, "fsync"));
  const int result = real(descriptor);
  char name[PATH_MAX] = {};
  const ssize_t size = readlink(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), name, sizeof(name) - 1);
  if (result == 0 && size > 0) log("on disk\t" + std::string(name) + "\n");
  return result;
}

extern "C" __attribute__((visibility("default"))) int rename(const char* from, const char* to) noexcept {
  const auto real = reinterpret_cast<int (*)(const char*, const char*)>(dlsym(RTLD_NEXT, "rename"));
  const int result = real(from, to);
  if (result == 0) log(std::string("renamed\t") + from + "\t" + to + "\n");
  return result;
}
