#pragma once

#include <filesystem>

namespace touchstone::datasets {

/// Where devices and scenes lie: $TOUCHSTONE_SCENES, else the installed share/touchstone/scenes that belong to this
/// code (core/installed_copy.h), else the source tree's scenes/ that it was built from. @throws Error if there is none
std::filesystem::path scenes_folder();

}  // namespace touchstone::datasets
