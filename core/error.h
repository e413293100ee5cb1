#pragma once
// What goes wrong: a user's mistake is an Error that says where; a bug of ours is a failed TS_ASSERT.

#include <fmt/core.h>

#include <stdexcept>
#include <string>

namespace touchstone {

/// A place in an input file. `line` counts from 1; 0 means that the line isn't known.
struct SourceLocation {
  std::string file;
  int line = 0;
};

/// A mistake in what was given to the program: it names file, line, field, value and what is allowed.
/// `what()` is one line, `file:line: message` where the place is known.
class Error : public std::runtime_error {
 public:
  /// A mistake that has no place in a file.
  explicit Error(const std::string& message);
  Error(SourceLocation where, const std::string& message);

  const SourceLocation& where() const { return where_; }

 private:
  SourceLocation where_;
};

/// What fail() and fail_at() call: compiled once, not for each list of arguments.
[[noreturn]] void fail_with(fmt::string_view format, fmt::format_args args);
[[noreturn]] void fail_with(const SourceLocation& where, fmt::string_view format, fmt::format_args args);

/// Throws an Error whose message is formatted by {fmt}.
template <typename... Args>
[[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) {
  fail_with(format, fmt::make_format_args(args...));
}

/// The same, with the place in an input file at which it went wrong.
template <typename... Args>
[[noreturn]] void fail_at(const SourceLocation& where, fmt::format_string<Args...> format, Args&&... args) {
  fail_with(where, format, fmt::make_format_args(args...));
}

/// Prints the broken claim and aborts. Called by TS_ASSERT.
[[noreturn]] void assertion_failed(const char* expression, const char* file, int line);

}  // namespace touchstone

/// A claim about our own code. It is checked in every build: each use stands outside inner loops.
#define TS_ASSERT(expression) \
  (static_cast<bool>(expression) ? void(0) : ::touchstone::assertion_failed(#expression, __FILE__, __LINE__))
