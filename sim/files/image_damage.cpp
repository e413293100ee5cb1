#include "sim/files/image_damage.h"

#include <tiffio.h>
#include <turbojpeg.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string_view>
#include <vector>

namespace touchstone {
namespace {

constexpr std::string_view kPngSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::string_view kExrSignature("\x76\x2f\x31\x01", 4);
constexpr std::string_view kJpegSignature("\xff\xd8\xff", 3);
// Of both orders of bytes; the later two are BigTIFF's.
constexpr std::array<std::string_view, 4> kTiffSignatures = {std::string_view("II*\0", 4), std::string_view("MM\0*", 4),
                                                             std::string_view("II+\0", 4),
                                                             std::string_view("MM\0+", 4)};
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

/// Where the coded pixels of each of a JPEG's scans end, as places in its bytes; of none if its markers can't be
/// followed, or if it is coded by arithmetic, whose decoder takes what isn't there for zeros.
std::vector<std::size_t> ends_of_scans(std::string_view bytes) {
  constexpr std::size_t kMostScans = 16;  // each costs a decoding; progressive files have about 10
  constexpr unsigned kStartOfScan = 0xDA, kEndOfImage = 0xD9, kFirstArithmetic = 0xC9, kLastArithmetic = 0xCB;
  std::vector<std::size_t> ends;
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  const auto is_marker = [&](std::size_t at) {  // that ends coded pixels: neither a stuffed zero nor a restart
    const unsigned next = byte(at + 1);
    return byte(at) == 0xFF && next != 0 && next != 0xFF && (next < 0xD0 || next > 0xD7);
  };
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    if (byte(at) != 0xFF) return {};
    const unsigned marker = byte(at + 1);
    if (marker == 0xFF) {  // filling
      ++at;
      continue;
    }
    if (marker == kEndOfImage) break;
    if (marker >= kFirstArithmetic && marker <= kLastArithmetic) return {};
    at += 2 + big_endian(bytes.substr(at + 2, 2));
    if (marker != kStartOfScan) continue;
    while (at + 2 <= bytes.size() && !is_marker(at)) ++at;
    if (at + 2 > bytes.size() || ends.size() == kMostScans) return {};
    ends.push_back(at);
  }
  return ends;
}

/// Decodes JPEGs, an eighth as large a side, which reads all codes and costs least.
class JpegTrial {
 public:
  /// What is wrong with the coded pixels, in libjpeg's words; what it only finds odd in the header isn't.
  std::string damage(std::string_view bytes) {
    const auto* const data = reinterpret_cast<const unsigned char*>(bytes.data());
    int width = 0, height = 0, sampling = 0, colours = 0;
    std::string odd;
    if (tjDecompressHeader3(decoder_.get(), data, bytes.size(), &width, &height, &sampling, &colours) != 0) {
      odd = tjGetErrorStr2(decoder_.get());
      if (tjGetErrorCode(decoder_.get()) == TJERR_FATAL || odd == "Premature end of JPEG file") return odd;
    }
    if (static_cast<long long>(width) * height > kMostPixels) return "";  // it won't be read
    constexpr tjscalingfactor kEighth = {1, 8};
    const int columns = TJSCALED(width, kEighth), rows = TJSCALED(height, kEighth);
    const int format = colours == TJCS_GRAY                           ? TJPF_GRAY
                       : colours == TJCS_CMYK || colours == TJCS_YCCK ? TJPF_CMYK
                                                                      : TJPF_RGB;
    pixels_.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) *
                   static_cast<std::size_t>(tjPixelSize[format]));
    if (tjDecompress2(decoder_.get(), data, bytes.size(), pixels_.data(), columns, 0, rows, format, 0) == 0) return "";
    std::string wrong = tjGetErrorStr2(decoder_.get());
    return wrong == odd ? "" : wrong;
  }

 private:
  struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
  };
  std::unique_ptr<void, Destroy> decoder_{tjInitDecompress()};
  std::vector<unsigned char> pixels_;
};

/// A JPEG has no checksums, and its codes find back into step behind a damaged place: as many blocks too many or too
/// few were read by then. Too few bits make libjpeg warn, and too many of them, but for a few bytes. So what lies
/// before a scan's last bytes must not be enough for it.
std::string jpeg_damage(const std::string& bytes) {
  JpegTrial trial;
  const std::vector<std::size_t> ends = ends_of_scans(bytes);
  const auto without = [&](std::size_t from, std::size_t to) {
    return trial.damage(bytes.substr(0, from) + bytes.substr(to));
  };
  const auto unfilled = [&](std::size_t end) {  // cameras fill up with zeros and ones, of which libjpeg warns
    while (end > 0 && (bytes[end - 1] == '\0' || bytes[end - 1] == '\xff')) --end;
    return end;
  };
  if (std::string damage = trial.damage(bytes); !damage.empty()) {
    if (ends.empty() || !without(unfilled(ends.back()), ends.back()).empty()) return damage;
  }
  for (const std::size_t end : ends) {
    const std::size_t last = unfilled(end);
    if (last > 0 && without(last - 1, end).empty()) {
      return "its coded pixels are damaged: there are more of them than its size takes";
    }
  }
  return "";
}

/// What libtiff says of the coded pixels.
struct TiffComplaint {
  bool of_pixels = false;
  std::string text;

  static int hear(TIFF*, void* self, const char*, const char* format, va_list arguments) {
    auto& heard = *static_cast<TiffComplaint*>(self);
    if (!heard.of_pixels || !heard.text.empty()) return 1;
    std::array<char, 200> line{};
    std::vsnprintf(line.data(), line.size(), format, arguments);
    heard.text = line.data();
    return 1;  // nobody else is to hear of it
  }
};

/// Does zlib's stream end in the checksum of what it holds? libtiff stops before that.
bool inflates(std::string& packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return true;
  std::array<Bytef, 1 << 16> out{};
  stream.next_in = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  int state = Z_OK;
  while (state == Z_OK) {
    stream.next_out = out.data();
    stream.avail_out = static_cast<uInt>(out.size());
    state = inflate(&stream, Z_NO_FLUSH);
  }
  inflateEnd(&stream);
  return state == Z_STREAM_END;
}

/// OpenImageIO gives what libtiff couldn't read as black.
std::string tiff_damage(const char* path) {
  TiffComplaint heard;
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                 &TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), &TiffComplaint::hear, &heard);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), &TiffComplaint::hear, &heard);
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> file(TIFFOpenExt(path, "r", options.get()), &TIFFClose);
  if (!file) return "";  // OpenImageIO says why
  std::uint32_t width = 0, height = 0;
  std::uint16_t packing = COMPRESSION_NONE;
  TIFFGetField(file.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(file.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(file.get(), TIFFTAG_COMPRESSION, &packing);
  if (static_cast<std::uint64_t>(width) * height > kMostPixels) return "";
  const bool tiled = TIFFIsTiled(file.get()) != 0;
  const bool zipped = packing == COMPRESSION_ADOBE_DEFLATE || packing == COMPRESSION_DEFLATE;
  const std::uint32_t parts = tiled ? TIFFNumberOfTiles(file.get()) : TIFFNumberOfStrips(file.get());
  const tmsize_t size = tiled ? TIFFTileSize(file.get()) : TIFFStripSize(file.get());
  constexpr tmsize_t kLargest = 64 * kMostPixels;
  if (size <= 0 || size > kLargest) return "";
  heard.of_pixels = true;
  std::vector<unsigned char> pixels(static_cast<std::size_t>(size));
  std::string packed;
  for (std::uint32_t part = 0; part < parts; ++part) {
    const tmsize_t got = tiled ? TIFFReadEncodedTile(file.get(), part, pixels.data(), size)
                               : TIFFReadEncodedStrip(file.get(), part, pixels.data(), size);
    if (got < 0 && heard.text.empty()) heard.text = "its pixels can't be decoded";
    if (!heard.text.empty()) return heard.text;
    if (!zipped) continue;
    packed.resize(TIFFGetStrileByteCount(file.get(), part));
    auto* const to = packed.data();
    const auto most = static_cast<tmsize_t>(packed.size());
    const tmsize_t raw =
        tiled ? TIFFReadRawTile(file.get(), part, to, most) : TIFFReadRawStrip(file.get(), part, to, most);
    if (raw != most || !inflates(packed)) return "its packed pixels aren't what their checksum says";
  }
  return "";
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
  if (signature.starts_with(kJpegSignature)) {
    file.clear();
    file.seekg(0);
    return jpeg_damage(std::string(next(file, static_cast<std::size_t>(size), buffer)));
  }
  const std::string_view mark = signature.substr(0, std::min<std::size_t>(4, signature.size()));
  if (std::ranges::find(kTiffSignatures, mark) != kTiffSignatures.end()) return tiff_damage(path);
  if (!signature.starts_with(kExrSignature)) return "";
  file.clear();
  file.seekg(static_cast<std::streamoff>(kExrSignature.size()));
  return exr_damage(file, size);
}

}  // namespace touchstone
