#pragma once
// Packets of bytes, packed each by itself as one frame of LZ4 or Zstandard.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace touchstone::sensors {

/// As AEDAT 4.0 numbers them; the high ones differ in what the writer spends only.
enum class PacketCompression { none = 0, lz4 = 1, lz4_high = 2, zstd = 3, zstd_high = 4 };

/// One LZ4 frame, with a checksum of the content.
std::vector<char> pack_lz4(std::span<const char> content);

/// Unpacks one frame into `content`. Returns what is wrong, or an empty text: not a frame of this kind, broken off, a
/// wrong checksum, bytes behind it, or more than `most_bytes` of content.
std::string unpack(PacketCompression compression, std::span<const char> frame, std::size_t most_bytes,
                   std::vector<char>& content);

}  // namespace touchstone::sensors
