#pragma once

#include <functional>
#include <string>

#include "core/error.h"

namespace touchstone::test {

/// What the Error says that `act` ends with, or "no error".
inline std::string message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace touchstone::test
