#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {

/// Calls `act()`. @throws Error from it, naming the file
template <typename Act>
void naming(const std::filesystem::path& file, const Act& act) {
  try {
    act();
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.find(file.string()) != std::string::npos) throw;
    fail("{}: {}", file.string(), message);
  }
}

/// Reads a picture and calls `act(image)` on it. @throws Error from either, naming the picture
template <typename Act>
void on_picture(const std::filesystem::path& file, const Act& act) {
  naming(file, [&] { act(sim::read_image(file)); });
}

/// Calls `act()`, which isn't to end the work on other files. Gives what is wrong, or "".
template <typename Act>
std::string fault_in(const Act& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// The same of one frame of many, which isn't to end the work on the others. Gives what is wrong with it, or "".
template <typename Act>
std::string fault_on_picture(const std::filesystem::path& file, const Act& act) {
  return fault_in([&] { on_picture(file, act); });
}

/// @param faults of the frames that can't be used
/// @throws Error with the first of them if they are all of the frames
inline void require_a_frame(const std::vector<std::string>& faults, std::size_t frames) {
  if (faults.empty() || faults.size() < frames) return;
  fail("none of {} frames can be used; the first: {}", frames, faults.front());
}

}  // namespace touchstone::datasets
