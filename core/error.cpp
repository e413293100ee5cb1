#include "core/error.h"

#include <cstdio>
#include <cstdlib>

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

void assertion_failed(const char* expression, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: this should hold and doesn't: %s\n", file, line, expression);
  std::abort();
}

}  // namespace touchstone
