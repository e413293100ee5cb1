#pragma once

#include <string_view>

namespace touchstone {

/// As deep as JSON from outside may be nested: none of ours needs more than ten. Readers and writers of JSON go into it
/// by recursion, so that a file of a hundred thousand brackets would overflow the stack.
inline constexpr int kDeepestJson = 100;

/// How deep brackets and braces are nested in a text that is meant to be JSON, those within its strings aside.
int deepest_json(std::string_view text);

}  // namespace touchstone
