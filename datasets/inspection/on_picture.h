#pragma once

#include <filesystem>
#include <string>

#include "core/error.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {

/// Reads a picture and calls `act(image)` on it. @throws Error from either, naming the picture
template <typename Act>
void on_picture(const std::filesystem::path& file, const Act& act) {
  try {
    act(sim::read_image(file));
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.find(file.string()) != std::string::npos) throw;
    fail("{}: {}", file.string(), message);
  }
}

}  // namespace touchstone::datasets
