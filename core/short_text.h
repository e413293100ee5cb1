#pragma once

#include <string>
#include <string_view>

namespace touchstone {

/// A value from outside as an error message may show it: cut to 60 bytes, "..." behind them, and control characters
/// written as their codes, `\x1b`, so that it's one line and can't command a terminal. No letter of UTF-8 is cut
/// apart.
std::string short_text(std::string_view value);

}  // namespace touchstone
