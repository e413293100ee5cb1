#include "datasets/jobs/scenes_folder.h"

#include <cstdlib>
#include <vector>

#include "core/error.h"
#include "core/installed_copy.h"

namespace touchstone::datasets {

std::filesystem::path scenes_folder() {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  const char* given = std::getenv("TOUCHSTONE_SCENES");
  if (given != nullptr && *given != '\0') {
    places.emplace_back(given);
  } else {
    for (const fs::path& folder : installed_data_folders()) places.push_back(folder / "scenes");
    places.emplace_back(TOUCHSTONE_SOURCE_SCENES);
  }
  std::error_code ignored;
  for (const fs::path& place : places) {
    if (fs::is_directory(place / "devices", ignored)) return place;
  }
  fail("{}: there is no folder of scenes; TOUCHSTONE_SCENES may name one", places.front().string());
}

}  // namespace touchstone::datasets
