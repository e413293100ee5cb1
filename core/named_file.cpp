#include "core/named_file.h"

#include <fmt/format.h>

#include <system_error>

#include "core/error.h"
#include "core/short_text.h"

namespace touchstone {

std::string fault_of_file(const std::filesystem::path& path) {
  std::error_code error;  // also for a name longer than the system has any
  const std::string& name = path.native();
  switch (std::filesystem::status(path, error).type()) {
    case std::filesystem::file_type::regular:
      return {};
    case std::filesystem::file_type::not_found:
      return fmt::format("there is no file {}", name);
    case std::filesystem::file_type::directory:
      return fmt::format("{} is a folder; a file is needed", name);
    case std::filesystem::file_type::none:
    case std::filesystem::file_type::unknown:
      return fmt::format("the file {} can't be read ({})", short_text(name), error.message());
    default:
      return fmt::format("{} is a pipe or a device; only files are read", name);
  }
}

std::filesystem::path named_file(const YamlReader& in, const std::string& key, const std::string& name) {
  std::filesystem::path file = in.folder() / name;
  if (const std::string fault = fault_of_file(file); !fault.empty()) {
    fail_at(in.where(key), "{}{}: {}", in.context(), key, fault);
  }
  return file;
}

}  // namespace touchstone
