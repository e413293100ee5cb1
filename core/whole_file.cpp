#include "core/whole_file.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>

#include "core/error.h"
#include "core/input_file.h"

namespace touchstone {

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
  static std::atomic<unsigned> serial{0};
  // Two processes may write the same file at once: each has a temporary name of its own, the last rename wins whole.
  // The ending stays last, because writers choose a format by it.
  const std::filesystem::path temporary =
      path.parent_path() /
      fmt::format(".{}.{}.{}.part{}", path.stem().string(), getpid(), serial++, path.extension().string());
  try {
    write(temporary);
    std::filesystem::rename(temporary, path);
  } catch (const std::filesystem::filesystem_error& error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    fail("{}: can't be written ({})", path.string(), error.code().message());
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw;
  }
}

void write_whole_file(const std::filesystem::path& path, std::string_view content) {
  write_whole_file(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.close();
    if (!out) fail("{}: can't be written", path.string());
  });
}

}  // namespace touchstone
