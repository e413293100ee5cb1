#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace touchstone {

/// The known name that is nearest to `name` by edit distance, if any is near enough to be what was meant
/// (at most a third of its letters changed, and at least one allowed).
std::optional<std::string> nearest_name(std::string_view name, std::span<const std::string> known);

/// ` (did you mean 'x'?)` for the nearest name, else the empty string.
std::string did_you_mean(std::string_view name, std::span<const std::string> known);

}  // namespace touchstone
