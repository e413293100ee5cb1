#pragma once
// Events and files of events that are made by hand, for tests of their readers and writers.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"

namespace touchstone {

inline bool operator==(const Event& a, const Event& b) {
  return a.t_us == b.t_us && a.x == b.x && a.y == b.y && a.on == b.on;
}

inline std::ostream& operator<<(std::ostream& out, const Event& e) {
  return out << "(" << e.t_us << " us, " << e.x << ", " << e.y << ", " << (e.on ? "ON" : "OFF") << ")";
}

namespace sensors::fixtures {

constexpr int kWidth = 346;
constexpr int kHeight = 260;

/// `count` events as an emulator hands them out: bursts of one time, rows of neighbours, silences.
inline std::vector<Event> bursts_of_events(int count, std::uint32_t seed = 1, std::int64_t first_us = 0) {
  std::uint64_t state = seed;
  const auto below = [&](std::uint64_t n) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (state >> 33) % n;
  };
  std::vector<Event> events;
  std::int64_t t_us = first_us;
  while (static_cast<int>(events.size()) < count) {
    t_us += static_cast<std::int64_t>(below(8) == 0 ? below(20'000) : below(30));
    const auto y = static_cast<std::uint16_t>(below(kHeight));
    std::uint64_t x = below(kWidth);
    const std::uint64_t length = 1 + below(below(3) == 0 ? 60 : 2);
    for (std::uint64_t i = 0; i < length && x < kWidth && static_cast<int>(events.size()) < count; ++i) {
      events.push_back({t_us, static_cast<std::uint16_t>(x), y, below(9) > 3});
      x += 1 + (below(4) == 0 ? below(20) : 0);
    }
  }
  return events;
}

/// Little-endian words of 16 bits.
inline std::string words(std::initializer_list<unsigned> values) {
  std::string bytes;
  for (const unsigned value : values) {
    bytes += static_cast<char>(value & 0xFF);
    bytes += static_cast<char>(value >> 8);
  }
  return bytes;
}

/// A number of `bytes` bytes, little-endian.
inline std::string number(std::int64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 0xFF);
  return text;
}

}  // namespace sensors::fixtures
}  // namespace touchstone
