#include "sim/files/image_damage.h"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <string_view>

namespace touchstone {
namespace {

constexpr std::string_view kPngSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::string_view kExrSignature("\x76\x2f\x31\x01", 4);
constexpr unsigned kExrOfParts = 0x10;     // in its version's second byte: headers follow each other, then an empty one
constexpr std::size_t kLongestName = 255;  // of an EXR's notes
constexpr std::uint32_t kLongestChunk = 0x7fffffff;

/// The next bytes of the file; fewer only at its end.
std::string_view next(std::ifstream& file, std::size_t most, std::string& into) {
  into.resize(most);
  file.read(into.data(), static_cast<std::streamsize>(most));
  return {into.data(), static_cast<std::size_t>(file.gcount())};
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t number = 0;
  for (const char byte : bytes) number = number << 8 | static_cast<unsigned char>(byte);
  return number;
}

uLong checksum(uLong before, std::string_view bytes) {
  return crc32(before, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size()));
}

/// From behind the signature on.
std::string png_damage(std::ifstream& file) {
  std::string buffer;
  bool pixels = false;
  for (bool first = true;; first = false) {
    const std::string_view head = next(file, 8, buffer);
    if (head.size() < 8) return pixels ? "" : "it ends before its pixels";
    const std::uint32_t length = big_endian(head.substr(0, 4));
    const std::string type(head.substr(4));
    if (!std::all_of(type.begin(), type.end(), [](unsigned char c) { return c < 128 && std::isalpha(c) != 0; })) {
      return "a chunk's name is damaged";
    }
    if (first && type != "IHDR") return "it doesn't begin with a chunk IHDR";
    if (pixels && type != "IDAT") return "";
    if (type == "IEND") return "it has no pixels";
    pixels = type == "IDAT";
    if (length > kLongestChunk) return "the length of its chunk " + type + " is damaged";
    uLong sum = checksum(crc32(0, nullptr, 0), type);
    for (std::uint32_t left = length; left > 0;) {
      const std::size_t most = std::min<std::uint32_t>(left, 1 << 16);
      const std::string_view part = next(file, most, buffer);
      if (part.size() < most) return "it ends within its chunk " + type;
      sum = checksum(sum, part);
      left -= static_cast<std::uint32_t>(most);
    }
    const std::string_view said = next(file, 4, buffer);
    if (said.size() < 4) return "it ends within its chunk " + type;
    const bool needed = std::isupper(static_cast<unsigned char>(type[0])) != 0;
    if (needed && big_endian(said) != sum) return "its chunk " + type + " isn't what its checksum says";
  }
}

/// A name up to its zero byte; nothing that a name can be if there's none within the longest one.
std::string exr_name(std::ifstream& file) {
  std::string name;
  for (char byte = 0; file.get(byte) && byte != 0 && name.size() <= kLongestName;) name += byte;
  return name;
}

/// From behind the signature on. All but lengths is left to OpenEXR.
std::string exr_damage(std::ifstream& file, std::streamoff size) {
  std::string buffer;
  const std::string_view version = next(file, 4, buffer);
  if (version.size() < 4) return "it ends within its header";
  const bool of_parts = (static_cast<unsigned char>(version[1]) & kExrOfParts) != 0;
  for (bool empty = true;; empty = false) {
    std::string name = exr_name(file);
    if (name.empty() && of_parts && !empty) {
      name = exr_name(file);  // the next part's first note
    }
    if (name.empty() || name.size() > kLongestName || exr_name(file).size() > kLongestName) return "";
    const std::string_view said = next(file, 4, buffer);
    if (said.size() < 4) return "it ends within its header";
    const std::string reversed(said.rbegin(), said.rend());
    const std::streamoff length = big_endian(reversed);
    if (length > size - file.tellg()) return "a note of its header is longer than the file";
    file.seekg(length, std::ios::cur);
  }
}

}  // namespace

std::string image_damage(const char* path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  file.seekg(0);
  std::string buffer;
  const std::string_view signature = next(file, kPngSignature.size(), buffer);
  if (signature == kPngSignature) return png_damage(file);
  if (signature.starts_with(kPngSignature.substr(0, 4)))
    return "its first bytes, which say that it is a PNG, are damaged";
  if (!signature.starts_with(kExrSignature)) return "";
  file.clear();
  file.seekg(static_cast<std::streamoff>(kExrSignature.size()));
  return exr_damage(file, size);
}

}  // namespace touchstone
