#include "core/mapped_file.h"

#include <sys/mman.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"
#include "core/input_file.h"

namespace touchstone {

MappedFile map_file(const std::filesystem::path& path) {
  const InputFile file(path);
  const std::size_t size = file.size();
  if (size == 0) return {};
  void* const memory = mmap(nullptr, size, PROT_READ, MAP_SHARED, file.descriptor(), 0);  // outlives the handle
  if (memory == MAP_FAILED) fail("{}: can't be read ({})", path.string(), std::strerror(errno));
  return {std::shared_ptr<const char>(static_cast<const char*>(memory),
                                      [memory, size](const char*) { munmap(memory, size); }),
          size};
}

}  // namespace touchstone
