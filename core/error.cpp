#include "core/error.h"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace touchstone {
namespace {

std::string at(const SourceLocation& where, const std::string& message) {
  if (where.file.empty()) return message;
  if (where.line <= 0) return where.file + ": " + message;
  return where.file + ":" + std::to_string(where.line) + ": " + message;
}

}  // namespace

Error::Error(const std::string& message) : std::runtime_error(message) {}

Error::Error(SourceLocation where, const std::string& message)
    : std::runtime_error(at(where, message)), where_(std::move(where)) {}

void fail_with(fmt::string_view format, fmt::format_args args) {
  throw Error(fmt::vformat(format, args));
}

void fail_with(const SourceLocation& where, fmt::string_view format, fmt::format_args args) {
  throw Error(where, fmt::vformat(format, args));
}

void assertion_failed(const char* expression, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: this should hold and doesn't: %s\n", file, line, expression);
  std::abort();
}

}  // namespace touchstone
