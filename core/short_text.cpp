#include "core/short_text.h"

#include <fmt/format.h>

namespace touchstone {

std::string short_text(std::string_view value) {
  constexpr std::size_t kMost = 60;
  std::size_t end = value.size();
  if (end > kMost) {
    end = kMost;
    const auto continues = [&](std::size_t at) { return (static_cast<unsigned char>(value[at]) & 0xC0U) == 0x80U; };
    while (end > kMost - 3 && continues(end)) --end;
  }
  std::string shown;
  for (const char letter : value.substr(0, end)) {
    const auto code = static_cast<unsigned char>(letter);
    if (code < 0x20 || code == 0x7F) {
      shown += fmt::format("\\x{:02x}", code);
    } else {
      shown += letter;
    }
  }
  return end < value.size() ? shown + "..." : shown;
}

}  // namespace touchstone
