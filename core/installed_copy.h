#pragma once
// Where this copy of Touchstone lies, and beside it what isn't code: shipped scenes, the module for image files.

#include <filesystem>
#include <vector>

namespace touchstone {

/// The file that this code was loaded from: the running program, or a library within another one, as Python's module.
std::filesystem::path own_file();

/// PREFIX/share/touchstone of each prefix that this code may have been installed to, the likeliest first. It is the one
/// that another project's program was linked from (cmake/TouchstoneConfig.cmake.in), or the one that the own file lies
/// in, as bin/touchstone or as lib/python3.11/dist-packages/touchstone/_core.so. In a build tree none of them is there.
std::vector<std::filesystem::path> installed_data_folders();
/// PREFIX/lib/touchstone, likewise.
std::vector<std::filesystem::path> installed_module_folders();

}  // namespace touchstone
