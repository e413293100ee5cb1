#include "core/own_module.h"

#include <dlfcn.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <system_error>
#include <vector>

#include "core/error.h"
#include "core/installed_copy.h"

namespace touchstone {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> places_of(const OwnModule& module) {
  std::vector<fs::path> places;
  std::error_code unknown;
  const fs::path own = fs::canonical(own_file(), unknown).parent_path();
  if (!unknown) places = {own / module.name, own / "touchstone" / module.name};
  for (const fs::path& folder : installed_module_folders()) places.push_back(folder / module.name);
  places.push_back(module.built);
  return places;
}

}  // namespace

const void* open_own_module(const OwnModule& module) {
  const std::vector<fs::path> places = places_of(module);
  std::error_code ignored;
  const auto found = std::ranges::find_if(places, [&](const fs::path& place) { return fs::exists(place, ignored); });
  if (found == places.end()) {
    std::vector<std::string> all;
    for (const fs::path& place : places) all.push_back(place.string());
    fail("the module for {} is missing; it was looked for as {}", module.purpose, fmt::join(all, ", "));
  }
  void* const opened = dlopen(found->c_str(), RTLD_NOW | RTLD_LOCAL);
  if (opened == nullptr) fail("{}: the module for {} can't be loaded ({})", found->string(), module.purpose, dlerror());
  using Function = const void* (*)();
  const auto table = reinterpret_cast<Function>(dlsym(opened, module.symbol));
  if (table == nullptr) refuse_module_version(module);
  return table();
}

void refuse_module_version(const OwnModule& module) {
  fail("{}: the module for {} belongs to another version of Touchstone", module.name, module.purpose);
}

}  // namespace touchstone
