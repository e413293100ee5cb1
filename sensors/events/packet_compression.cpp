#include "sensors/events/packet_compression.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr std::size_t kFirstBytes = 1 << 18;

/// Makes space for more content; false if there's as much as is allowed.
bool grow(std::vector<char>& content, std::size_t used, std::size_t most_bytes) {
  if (used < content.size()) return true;
  if (content.size() >= most_bytes) return false;
  content.resize(std::min(most_bytes, std::max(kFirstBytes, 2 * content.size())));
  return true;
}

std::string too_much(std::size_t most_bytes) {
  return fmt::format("unpacks to more than the {} bytes that are allowed", most_bytes);
}

std::string unpack_lz4(std::span<const char> frame, std::size_t most_bytes, std::vector<char>& content) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) return "can't be unpacked (no memory)";
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(made,
                                                                                     LZ4F_freeDecompressionContext);
  std::size_t taken = 0;
  std::size_t used = 0;
  for (std::size_t hint = 1; hint != 0;) {
    if (!grow(content, used, most_bytes)) return too_much(most_bytes);
    std::size_t space = content.size() - used;
    std::size_t left = frame.size() - taken;
    hint = LZ4F_decompress(context.get(), content.data() + used, &space, frame.data() + taken, &left, nullptr);
    if (LZ4F_isError(hint)) return fmt::format("isn't a sound LZ4 frame ({})", LZ4F_getErrorName(hint));
    if (space == 0 && left == 0 && hint != 0) return "is an LZ4 frame that is broken off";
    used += space;
    taken += left;
  }
  if (taken != frame.size()) return fmt::format("has {} bytes behind its LZ4 frame", frame.size() - taken);
  content.resize(used);
  return {};
}

std::string unpack_zstd(std::span<const char> frame, std::size_t most_bytes, std::vector<char>& content) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
  if (!context) return "can't be unpacked (no memory)";
  ZSTD_inBuffer in{frame.data(), frame.size(), 0};
  std::size_t used = 0;
  for (std::size_t hint = 1; hint != 0;) {
    if (!grow(content, used, most_bytes)) return too_much(most_bytes);
    ZSTD_outBuffer out{content.data() + used, content.size() - used, 0};
    const std::size_t before = in.pos;
    hint = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_isError(hint)) return fmt::format("isn't a sound Zstandard frame ({})", ZSTD_getErrorName(hint));
    if (out.pos == 0 && in.pos == before && hint != 0) return "is a Zstandard frame that is broken off";
    used += out.pos;
  }
  if (in.pos != in.size) return fmt::format("has {} bytes behind its Zstandard frame", in.size - in.pos);
  content.resize(used);
  return {};
}

}  // namespace

std::vector<char> pack_lz4(std::span<const char> content) {
  LZ4F_preferences_t wish{};
  wish.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  std::vector<char> frame(LZ4F_compressFrameBound(content.size(), &wish));
  const std::size_t size = LZ4F_compressFrame(frame.data(), frame.size(), content.data(), content.size(), &wish);
  TS_ASSERT(!LZ4F_isError(size));
  frame.resize(size);
  return frame;
}

std::string unpack(PacketCompression compression, std::span<const char> frame, std::size_t most_bytes,
                   std::vector<char>& content) {
  if (content.size() > most_bytes) content.resize(most_bytes);
  switch (compression) {
    case PacketCompression::none:
      if (frame.size() > most_bytes) return too_much(most_bytes);
      content.assign(frame.begin(), frame.end());
      return {};
    case PacketCompression::lz4:
    case PacketCompression::lz4_high:
      return unpack_lz4(frame, most_bytes, content);
    case PacketCompression::zstd:
    case PacketCompression::zstd_high:
      return unpack_zstd(frame, most_bytes, content);
  }
  TS_ASSERT(false);
  return {};
}

}  // namespace touchstone::sensors
