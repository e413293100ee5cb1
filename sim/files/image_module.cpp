#include "sim/files/image_module.h"

#include <fcntl.h>
#include <unistd.h>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "sim/files/image_damage.h"

namespace {

constexpr int kLongestSide = 1 << 16;
constexpr int kMostChannels = 64;

int failed(const std::string& why, char* message, std::size_t size) {
  std::snprintf(message, size, "%s", why.c_str());
  for (char* c = message; *c != '\0'; ++c) {
    if (*c == '\n' || *c == '\r') *c = ' ';
  }
  return 1;
}

OIIO::TypeDesc type_of(TouchstoneDepth depth) {
  switch (depth) {
    case kTouchstoneU8:
      return OIIO::TypeUInt8;
    case kTouchstoneU16:
      return OIIO::TypeUInt16;
    case kTouchstoneFloat:
      break;
  }
  return OIIO::TypeFloat;
}

/// OpenImageIO's own writers don't notice a disk that gets full at the file's end, so they write to memory.
int write_bytes(const char* path, const std::vector<unsigned char>& bytes, char* message, std::size_t size) {
  std::FILE* const file = std::fopen(path, "wb");
  if (file == nullptr) return failed(std::strerror(errno), message, size);
  errno = 0;
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const int why = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written) return failed(std::strerror(why), message, size);
  if (!closed) return failed(std::strerror(errno), message, size);
  return 0;
}

/// A name for a file that OpenImageIO takes as it is: what stands behind a "?" it would take for settings of a reader.
class OpenedFile {
 public:
  explicit OpenedFile(const char* path) : name_(path) {
    if (name_.find('?') == std::string::npos) return;
    descriptor_ = open(path, O_RDONLY | O_CLOEXEC);
    name_ = "/proc/self/fd/" + std::to_string(descriptor_);
  }
  ~OpenedFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OpenedFile(const OpenedFile&) = delete;
  OpenedFile& operator=(const OpenedFile&) = delete;

  const std::string& name() const { return name_; }

 private:
  std::string name_;
  int descriptor_ = -1;
};

int write(const TouchstoneImageToWrite& image, char* message, std::size_t size) {
  const auto output = OIIO::ImageOutput::create(image.format);
  if (!output) return failed(OIIO::geterror(), message, size);
  OIIO::ImageSpec spec(image.width, image.height, image.channels, type_of(image.depth));
  spec.channelnames.assign(image.channel_names, image.channel_names + image.channels);
  spec.alpha_channel = -1;
  if (image.depth == kTouchstoneFloat) {
    spec.attribute("compression", "zip");
    // Without a date OpenImageIO writes the present one into an EXR, and equal pictures would be different files.
    spec.attribute("DateTime", "1970:01:01 00:00:00");
  } else {
    // Level 3 writes a camera frame 2 to 3 times faster than zlib's usual 6, for a few per cent more bytes.
    spec.attribute("png:compressionLevel", 3);
  }
  for (int i = 0; i < image.metadata_count; ++i) spec.attribute(image.metadata_keys[i], image.metadata_values[i]);
  OIIO::Filesystem::IOVecOutput memory;
  if (!output->set_ioproxy(&memory)) return failed("its writer can't write to memory", message, size);
  if (!output->open(image.path, spec)) return failed(output->geterror(), message, size);
  if (!output->write_image(type_of(image.depth), image.pixels, OIIO::AutoStride,
                           static_cast<OIIO::stride_t>(image.row_bytes))) {
    return failed(output->geterror(), message, size);
  }
  if (!output->close()) return failed(output->geterror(), message, size);
  return write_bytes(image.path, memory.buffer(), message, size);
}

int read(const char* path, const char* key, void* (*accept)(void*, const TouchstoneImageInfo*), void* context,
         char* message, std::size_t size) {
  OIIO::ImageSpec wishes;
  wishes.attribute("oiio:UnassociatedAlpha", 1);  // colours as they're stored, not multiplied by alpha
  if (const std::string damage = touchstone::image_damage(path); !damage.empty()) return failed(damage, message, size);
  const OpenedFile plainly(path);
  const auto input = OIIO::ImageInput::open(plainly.name(), &wishes);
  if (!input) return failed(OIIO::geterror(), message, size);
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.width < 1 || spec.height < 1 || spec.width > kLongestSide || spec.height > kLongestSide || spec.depth > 1 ||
      spec.nchannels < 1 || spec.nchannels > kMostChannels) {
    return failed("is " + std::to_string(spec.width) + "x" + std::to_string(spec.height) + " with " +
                      std::to_string(spec.nchannels) + " channels, which is out of bounds",
                  message, size);
  }
  if (static_cast<long long>(spec.width) * spec.height > touchstone::kMostPixels) {
    return failed("has " + std::to_string(spec.width) + "x" + std::to_string(spec.height) + " pixels; at most " +
                      std::to_string(touchstone::kMostPixels) + " are read",
                  message, size);
  }
  TouchstoneDepth depth = kTouchstoneFloat;
  if (spec.format == OIIO::TypeUInt8) depth = kTouchstoneU8;
  if (spec.format == OIIO::TypeUInt16) depth = kTouchstoneU16;
  std::vector<const char*> names;
  std::vector<std::string> kept;
  for (int i = 0; i < spec.nchannels; ++i) kept.push_back(spec.channel_name(i));
  for (const std::string& name : kept) names.push_back(name.c_str());
  const std::string value(spec.get_string_attribute(key));
  const TouchstoneImageInfo info = {.width = spec.width,
                                    .height = spec.height,
                                    .channels = spec.nchannels,
                                    .depth = depth,
                                    .channel_names = names.data(),
                                    .metadata_value = value.c_str(),
                                    .orientation = spec.get_int_attribute("Orientation", 1)};
  void* const pixels = accept(context, &info);
  if (pixels == nullptr) return 0;
  if (!input->read_image(0, 0, 0, spec.nchannels, type_of(depth), pixels)) {
    return failed(input->geterror(), message, size);
  }
  return 0;
}

// No exception may cross the border.
int guarded_write(const TouchstoneImageToWrite* image, char* message, std::size_t size) {
  try {
    return write(*image, message, size);
  } catch (const std::exception& error) {
    return failed(error.what(), message, size);
  }
}

int guarded_read(const char* path, const char* key, void* (*accept)(void*, const TouchstoneImageInfo*), void* context,
                 char* message, std::size_t size) {
  try {
    return read(path, key, accept, context, message, size);
  } catch (const std::exception& error) {
    return failed(error.what(), message, size);
  }
}

constexpr TouchstoneImageModule kTable = {
    .version = kTouchstoneImageModuleVersion, .write = guarded_write, .read = guarded_read};

}  // namespace

extern "C" __attribute__((visibility("default"))) const TouchstoneImageModule* touchstone_image_module_table() {
  return &kTable;
}
