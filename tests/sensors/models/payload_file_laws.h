#pragma once
// What holds for each file that is a line of JSON with numbers behind it (sensors/models/json_payload.h).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/error.h"

namespace touchstone::sensors::fixtures {

/// `bytes` with a piece of its first line replaced.
inline std::string with_line_changed(std::string bytes, const std::string& from, const std::string& to) {
  const std::size_t at = bytes.find(from);
  EXPECT_LT(at, bytes.find('\n')) << from;
  return bytes.replace(at, from.size(), to);
}

/// `read` takes a file's bytes; `bytes` is a good file.
template <typename Read>
void expect_damage_is_noticed(const Read& read, const std::string& bytes) {
  using ::testing::HasSubstr;
  using ::testing::ThrowsMessage;
  EXPECT_NO_THROW(read(bytes));
  EXPECT_THAT([&] { read("{\n"); }, ThrowsMessage<Error>(HasSubstr("isn't valid JSON")));
  for (const std::string& other : {bytes.substr(0, bytes.size() - 5), bytes + "x"}) {
    EXPECT_THAT([&] { read(other); }, ThrowsMessage<Error>(HasSubstr("cut short or damaged")));
  }
  std::string flipped = bytes;
  flipped[bytes.size() - 100] = static_cast<char>(flipped[bytes.size() - 100] ^ 1);
  EXPECT_THAT([&] { read(flipped); }, ThrowsMessage<Error>(HasSubstr("checksum")));
}

}  // namespace touchstone::sensors::fixtures
