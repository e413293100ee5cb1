#pragma once
// Model files that are a line of JSON and behind it numbers as they lie in memory, little-endian; the line holds the
// numbers' SHA-256. For the .cpp files of models only, as json_field.h.

#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/sha256.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {

static_assert(std::endian::native == std::endian::little, "the files are little-endian");

/// The numbers as they lie in memory.
template <typename T>
void append(std::string& payload, const T* values, std::size_t count) {
  payload.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

/// Moves the first `count` numbers out of a payload whose length was checked.
template <typename T>
void take(std::string_view& payload, T* values, std::size_t count) {
  TS_ASSERT(payload.size() >= count * sizeof(T));
  std::memcpy(values, payload.data(), count * sizeof(T));
  payload.remove_prefix(count * sizeof(T));
}

/// The whole file.
inline std::string with_payload(Json json, const std::string& payload) {
  json["sha256"] = sha256_of(payload);
  return json.dump() + "\n" + payload;
}

/// A file taken apart; `payload` points into its text.
struct JsonAndPayload {
  Json json;
  std::string_view payload;  ///< not checked yet
};

/// `kind` is what the file should be, with its article. @throws Error naming the file
inline JsonAndPayload split_payload(std::string_view bytes, const char* kind, const std::string& name) {
  const std::size_t end = bytes.find('\n');
  if (end == std::string_view::npos || bytes.front() != '{') {
    fail_at({name, 0}, "isn't {}: it doesn't begin with a line of JSON", kind);
  }
  return {parse_json(std::string(bytes.substr(0, end)), name), bytes.substr(end + 1)};
}

/// Refuses a payload of another length, bytes, or with another checksum than its line's.
inline void expect_payload(const JsonField& root, std::string_view payload, std::size_t length) {
  if (payload.size() != length) {
    root.refuse("has {} bytes after its first line; {} are needed: it is cut short or damaged", payload.size(), length);
  }
  if (sha256_of(payload) != root.at("sha256").text()) root.refuse("is damaged: its checksum doesn't fit");
}

}  // namespace touchstone::sensors
