#include "core/installed_copy.h"

#include <dlfcn.h>
#include <link.h>

#include <string>
#include <system_error>

/// Only programs of other projects have it: cmake/TouchstoneConfig.cmake.in makes it for them.
extern "C" __attribute__((weak, visibility("hidden"))) const char* touchstone_linked_prefix();

namespace touchstone {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> below_prefixes(const char* folder) {
  std::vector<fs::path> found;
  if (touchstone_linked_prefix != nullptr) found.push_back(fs::path(touchstone_linked_prefix()) / folder);
  std::error_code unknown;
  const fs::path own = fs::canonical(own_file(), unknown).parent_path();
  if (unknown) return found;
  const bool in_python = own.parent_path().filename() == "dist-packages";
  const fs::path prefix = in_python ? own.parent_path().parent_path().parent_path().parent_path() : own.parent_path();
  found.push_back(prefix / folder);
  return found;
}

}  // namespace

fs::path own_file() {
  Dl_info info;
  link_map* map = nullptr;
  const auto* here = reinterpret_cast<const void*>(&below_prefixes);
  if (dladdr1(here, &info, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP) != 0 && map != nullptr &&
      map->l_name != nullptr && *map->l_name != '\0') {
    return map->l_name;
  }
  return "/proc/self/exe";
}

std::vector<fs::path> installed_data_folders() {
  return below_prefixes(TOUCHSTONE_INSTALL_DATADIR "/touchstone");
}

std::vector<fs::path> installed_module_folders() {
  return below_prefixes(TOUCHSTONE_INSTALL_LIBDIR "/touchstone");
}

}  // namespace touchstone
