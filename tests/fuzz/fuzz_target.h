#pragma once
// What each fuzz target is: a program that takes any bytes for a file of one kind. Whatever they are, it ends in a
// result or in a touchstone::Error, within bounded time and memory. libfuzzer_entry.cpp gives it to libFuzzer, which
// looks for bytes that say otherwise, and replay_test.cpp to the tests, which try those that once did.

#include <string_view>

#include "core/error.h"

namespace touchstone::fuzz {

/// Takes the bytes for a file in every way that the target knows. Returns whether one of them gave a result.
bool reads(std::string_view bytes);

/// Whether `read` came to a result; false if it threw an Error. All else that it may throw isn't caught: it's a find.
template <typename Read>
bool gives_result(const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    TS_ASSERT(!std::string_view(error.what()).empty());
    return false;
  }
  return true;
}

}  // namespace touchstone::fuzz
