#include "datasets/sets/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>

#include "core/error.h"

namespace touchstone::datasets {
namespace {

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "an unknown host";
  return name.data();
}

std::string text_of(int descriptor) {
  std::array<char, 512> text{};
  const ssize_t size = pread(descriptor, text.data(), text.size() - 1, 0);
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "another process";
}

/// False if the file was removed or replaced since it was opened: then the lock guards nothing.
bool is_still_there(int descriptor, const std::filesystem::path& file) {
  struct stat opened {};
  struct stat there {};
  return fstat(descriptor, &opened) == 0 && stat(file.c_str(), &there) == 0 && opened.st_ino == there.st_ino &&
         opened.st_dev == there.st_dev;
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& file) {
  for (;;) {
    const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644);
    if (descriptor < 0) fail("{}: can't be made ({})", file.string(), std::strerror(errno));
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      const int why = errno;
      const std::string holder = text_of(descriptor);
      close(descriptor);
      if (why != EWOULDBLOCK) fail("{}: can't be locked ({})", file.string(), std::strerror(why));
      fail("{}: another run works on this folder ({})", file.parent_path().parent_path().string(), holder);
    }
    if (is_still_there(descriptor, file)) {
      descriptor_ = descriptor;
      break;
    }
    close(descriptor);  // the run that held it has just finished and cleared up
    if (!std::filesystem::exists(file.parent_path())) {
      fail("{}: another run has just finished in this folder", file.parent_path().parent_path().string());
    }
  }
  const std::string holder = fmt::format("process {} on {}", getpid(), host_name());
  if (ftruncate(descriptor_, 0) != 0 || pwrite(descriptor_, holder.data(), holder.size(), 0) < 0) {
    close(descriptor_);
    fail("{}: can't be written ({})", file.string(), std::strerror(errno));
  }
}

FolderLock::~FolderLock() {
  close(descriptor_);
}

}  // namespace touchstone::datasets
