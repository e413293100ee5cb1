#pragma once

#include <string>

#include "core/error.h"

namespace touchstone::sensors {

/// What the Error says that a call throws, or nothing.
template <typename Call>
std::string message_of(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace touchstone::sensors
