#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace touchstone {

/// A file from outside, opened for reading. Only regular files are: a pipe would keep the program waiting for who
/// writes into it, and a device may have no end. Opening never waits.
class InputFile {
 public:
  /// @throws Error if there is no such file, it may not be read, or is a folder, a pipe or a device
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Bytes, when it was opened.
  std::size_t size() const { return size_; }
  /// The next bytes: `most` of them, fewer only where the file ends. @throws Error if they can't be read
  std::size_t read(char* bytes, std::size_t most);
  /// The system's handle. It is closed with this object.
  int descriptor() const { return descriptor_; }

 private:
  std::string name_;
  int descriptor_ = -1;
  std::size_t size_ = 0;
};

}  // namespace touchstone
