#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/error.h"

namespace touchstone::sensors {

/// Calls `test(train(others), recording)` for each recording, `others` being all but that one. Gives whether that could
/// be done: false for fewer than two recordings, or where the others of one determine no model (train throws Error).
template <typename Recording, typename Train, typename Test>
bool test_left_out(std::span<const Recording> recordings, const Train& train, const Test& test) {
  if (recordings.size() < 2) return false;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    std::vector<Recording> others(recordings.begin(), recordings.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    try {
      test(train(others), recordings[i]);
    } catch (const Error&) {
      return false;
    }
  }
  return true;
}

}  // namespace touchstone::sensors
