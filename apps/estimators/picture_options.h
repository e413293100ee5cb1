#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

namespace touchstone::apps {

/// Where the pictures of frames with what is estimated of them go, besides a folder of files.
struct PictureOptions {
  bool live = false;
  int port = 0;                 ///< of the live view; 0: any free one
  std::filesystem::path video;  ///< empty: none
};

/// Adds --live PORT and --video FILE.
std::shared_ptr<PictureOptions> add_picture_options(CLI::App& command);

}  // namespace touchstone::apps
