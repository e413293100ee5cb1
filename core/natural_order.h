#pragma once

#include <string_view>

namespace touchstone {

/// Does name `a` stand before `b` where people look for it: "2.png" before "10.png"? Runs of digits are compared by
/// their value, of any length, all else byte by byte. A strict order: names of equal values ("1", "01") go by their
/// bytes.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace touchstone
