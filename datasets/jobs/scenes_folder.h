#pragma once

#include <filesystem>

namespace touchstone::datasets {

/// Where devices and scenes lie: $TOUCHSTONE_SCENES, else the source tree's scenes/ that this program was built from,
/// else the installed share/touchstone/scenes beside the program. @throws Error if there is none of them
std::filesystem::path scenes_folder();

}  // namespace touchstone::datasets
