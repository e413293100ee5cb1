#include "core/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <random>
#include <utility>

#include "core/error.h"
#include "core/input_file.h"
#include "core/whole_file_writer.h"

namespace touchstone {
namespace {

std::string unguessable_digits() {
  std::random_device device;
  return fmt::format("{:08x}{:08x}", device(), device());
}

/// A file that stands beside `path` until it takes its name. Nobody else can have put it, or a link, there before: its
/// name can't be guessed, and it's made or it's an error. Its ending is `path`'s, because writers choose a format by
/// it.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& path)
      : path_(path),
        name_(path.parent_path() /
              fmt::format(".{}.{}.part{}", path.stem().string(), unguessable_digits(), path.extension().string())),
        descriptor_(open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666)) {
    if (descriptor_ < 0) fail("{}: can't be written ({})", path_.string(), std::strerror(errno));
  }
  ~TemporaryFile() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!named_) unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& name() const { return name_; }
  std::size_t size() const {
    struct stat about {};
    return fstat(descriptor_, &about) == 0 ? static_cast<std::size_t>(about.st_size) : 0;
  }
  void append(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail("{}: can't be written ({})", path_.string(), std::strerror(errno));
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
  }
  void take_its_name() {
    // Over a network some faults of writing come with closing.
    if (close(std::exchange(descriptor_, -1)) != 0 || std::rename(name_.c_str(), path_.c_str()) != 0) {
      fail("{}: can't be written ({})", path_.string(), std::strerror(errno));
    }
    named_ = true;
  }

 private:
  std::filesystem::path path_;
  std::filesystem::path name_;
  int descriptor_ = -1;
  bool named_ = false;
};

}  // namespace

std::string read_whole_file(const std::filesystem::path& path) {
  InputFile file(path);
  // More than its size shows where it ends: those of /proc don't know their size.
  std::string content(std::max<std::size_t>(file.size() + 1, 4096), '\0');
  std::size_t size = 0;
  while ((size += file.read(content.data() + size, content.size() - size)) == content.size()) {
    content.resize(2 * content.size());
  }
  content.resize(size);
  return content;
}

void write_whole_file(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& temporary)>& write) {
  TemporaryFile file(path);
  write(file.name());
  if (file.size() == 0) fail("{}: can't be written (nothing was written)", path.string());
  file.take_its_name();
}

void write_whole_file(const std::filesystem::path& path, std::string_view content) {
  TemporaryFile file(path);
  file.append(content);
  file.take_its_name();
}

struct WholeFileWriter::Parts {
  explicit Parts(const std::filesystem::path& path) : file(path) {}

  TemporaryFile file;
  std::string waiting;
};

WholeFileWriter::WholeFileWriter(const std::filesystem::path& path) : parts_(std::make_unique<Parts>(path)) {}

WholeFileWriter::~WholeFileWriter() = default;

void WholeFileWriter::append(std::string_view content) {
  constexpr std::size_t kMostWaiting = 1 << 16;
  parts_->waiting += content;
  if (parts_->waiting.size() < kMostWaiting) return;
  parts_->file.append(parts_->waiting);
  parts_->waiting.clear();
}

const std::filesystem::path& WholeFileWriter::temporary() const {
  return parts_->file.name();
}

void WholeFileWriter::finish() {
  parts_->file.append(parts_->waiting);
  parts_->file.take_its_name();
}

void write_lasting_file(const std::filesystem::path& path, std::string_view content) {
  {
    TemporaryFile file(path);
    file.append(content);
    wait_for_disk(file.name());
    file.take_its_name();
  }
  wait_for_disk(path.has_parent_path() ? path.parent_path() : ".");
}

void wait_for_disk(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) fail("{}: can't be read ({})", path.string(), std::strerror(errno));
  // Some file systems, mostly those over a network, take no such wish for a folder.
  const int why = fsync(descriptor) == 0 || errno == EINVAL || errno == ENOTSUP ? 0 : errno;
  close(descriptor);
  if (why != 0) fail("{}: can't be written ({})", path.string(), std::strerror(why));
}

}  // namespace touchstone
