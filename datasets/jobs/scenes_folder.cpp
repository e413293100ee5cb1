#include "datasets/jobs/scenes_folder.h"

#include <cstdlib>
#include <vector>

#include "core/error.h"

namespace touchstone::datasets {

std::filesystem::path scenes_folder() {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  const char* given = std::getenv("TOUCHSTONE_SCENES");
  if (given != nullptr && *given != '\0') {
    places.emplace_back(given);
  } else {
    places.emplace_back(TOUCHSTONE_SOURCE_SCENES);
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error);
    if (!error) places.push_back(program.parent_path().parent_path() / "share/touchstone/scenes");
  }
  for (const fs::path& place : places) {
    if (fs::is_directory(place / "devices")) return place;
  }
  fail("{}: there is no folder of scenes; TOUCHSTONE_SCENES may name one", places.front().string());
}

}  // namespace touchstone::datasets
