#include "core/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace touchstone {

InputFile::InputFile(const std::filesystem::path& path)
    : name_(path.string()),
      // Non-blocking: a pipe that nobody writes into is opened at once, and can be refused.
      descriptor_(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {
  if (descriptor_ < 0) fail("{}: can't be read ({})", name_, std::strerror(errno));
  struct stat about {};
  const char* reason = nullptr;
  if (fstat(descriptor_, &about) != 0) {
    reason = std::strerror(errno);
  } else if (S_ISDIR(about.st_mode)) {
    reason = "it is a folder";
  } else if (!S_ISREG(about.st_mode)) {
    reason = "it is a pipe or a device; only files are read";
  }
  if (reason != nullptr) {
    close(descriptor_);
    fail("{}: can't be read ({})", name_, reason);
  }
  size_ = static_cast<std::size_t>(about.st_size);
}

InputFile::~InputFile() {
  close(descriptor_);
}

std::size_t InputFile::read(char* bytes, std::size_t most) {
  std::size_t done = 0;
  while (done < most) {
    const ssize_t count = ::read(descriptor_, bytes + done, most - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail("{}: can't be read ({})", name_, std::strerror(errno));
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

}  // namespace touchstone
