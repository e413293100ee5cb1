#include "core/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace touchstone {

MappedFile map_file(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat about {};
  void* memory = MAP_FAILED;
  bool readable = file >= 0 && fstat(file, &about) == 0;
  int reason = errno;
  if (readable && !S_ISREG(about.st_mode)) {
    readable = false;
    reason = EINVAL;
  }
  const auto size = static_cast<std::size_t>(about.st_size);
  if (readable && size > 0) {
    memory = mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0);
    reason = errno;
  }
  if (file >= 0) close(file);  // the mapping outlives it
  if (readable && size == 0) return {};
  if (memory == MAP_FAILED) fail("{}: can't be read ({})", path.string(), std::strerror(reason));
  return {std::shared_ptr<const char>(static_cast<const char*>(memory),
                                      [memory, size](const char*) { munmap(memory, size); }),
          size};
}

}  // namespace touchstone
