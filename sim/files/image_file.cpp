#include "sim/files/image_file.h"

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/error.h"
#include "core/own_module.h"
#include "core/whole_file.h"
#include "sim/files/image_module.h"

namespace touchstone::sim {
namespace {

namespace fs = std::filesystem;

// Loaded once; if that fails, the next call tries again.
const TouchstoneImageModule& image_module() {
  static const TouchstoneImageModule& module =
      own_module_table<TouchstoneImageModule>({.name = TOUCHSTONE_IMAGE_MODULE_NAME,
                                               .built = TOUCHSTONE_IMAGE_MODULE_BUILT,
                                               .purpose = "image files",
                                               .symbol = kTouchstoneImageModuleSymbol},
                                              kTouchstoneImageModuleVersion);
  return module;
}

using Message = std::array<char, 1024>;

void write_file(const fs::path& path, const char* format, TouchstoneDepth depth, const cv::Mat& pixels,
                const std::vector<std::string>& names, const ImageMetadata& metadata) {
  const TouchstoneImageModule& module = image_module();
  std::vector<const char*> name_texts;
  std::vector<const char*> keys;
  std::vector<const char*> values;
  for (const std::string& name : names) name_texts.push_back(name.c_str());
  for (const auto& [key, value] : metadata) {
    keys.push_back(key.c_str());
    values.push_back(value.c_str());
  }
  write_whole_file(path, [&](const fs::path& temporary) {
    const TouchstoneImageToWrite image = {.format = format,
                                          .path = temporary.c_str(),
                                          .width = pixels.cols,
                                          .height = pixels.rows,
                                          .channels = pixels.channels(),
                                          .depth = depth,
                                          .pixels = pixels.data,
                                          .row_bytes = pixels.step[0],
                                          .channel_names = name_texts.data(),
                                          .metadata_count = static_cast<int>(metadata.size()),
                                          .metadata_keys = keys.data(),
                                          .metadata_values = values.data()};
    Message message{};
    if (module.write(&image, message.data(), message.size()) != 0) {
      fail("{}: can't be written ({})", path.string(), message.data());
    }
  });
}

struct Picture {
  cv::Mat pixels;
  std::vector<std::string> names;
  std::string metadata_value;
  int orientation = 1;
};

// Without pixels if only the metadata is wanted.
Picture read_file(const fs::path& path, const std::string& key, bool with_pixels) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) fail("{}: can't be read (there is no such file)", path.string());
  struct Context {
    Picture picture;
    bool with_pixels;
    bool no_memory = false;
  } context = {{}, with_pixels};
  const auto accept = [](void* opaque, const TouchstoneImageInfo* info) -> void* {
    auto& to = *static_cast<Context*>(opaque);
    to.picture.names.assign(info->channel_names, info->channel_names + info->channels);
    to.picture.metadata_value = info->metadata_value;
    to.picture.orientation = info->orientation;
    if (!to.with_pixels) return nullptr;
    const int depth = info->depth == kTouchstoneU8 ? CV_8U : info->depth == kTouchstoneU16 ? CV_16U : CV_32F;
    try {
      to.picture.pixels.create(info->height, info->width, CV_MAKETYPE(depth, info->channels));
    } catch (const cv::Exception&) {
      to.no_memory = true;
      return nullptr;
    }
    return to.picture.pixels.data;
  };
  Message message{};
  if (image_module().read(path.c_str(), key.c_str(), accept, &context, message.data(), message.size()) != 0) {
    fail("{}: can't be read as an image ({})", path.string(), message.data());
  }
  if (context.no_memory) fail("{}: can't be read (there isn't memory enough for it)", path.string());
  return std::move(context.picture);
}

/// Turned as the camera has marked it: EXIF's orientation says what to do, 2 to 4 mirror or turn over, 5 to 8 also swap
/// rows and columns. Others than 1 to 8 say nothing.
cv::Mat upright(const cv::Mat& stored, int orientation) {
  if (orientation < 2 || orientation > 8) return stored;
  cv::Mat image;
  if (orientation >= 5) cv::transpose(stored, image);
  const cv::Mat& swapped = orientation >= 5 ? image : stored;
  switch (orientation) {
    case 2:  // mirrored
    case 6:  // a quarter clockwise: transposed, then mirrored
      cv::flip(swapped, image, 1);
      break;
    case 3:  // half a turn
    case 7:  // transposed over the other diagonal
      cv::flip(swapped, image, -1);
      break;
    case 4:  // upside down, mirrored
    case 8:  // a quarter anticlockwise
      cv::flip(swapped, image, 0);
      break;
    default:  // 5: transposed
      break;
  }
  return image;
}

void refuse_bad_metadata(const fs::path& path, const ImageMetadata& metadata) {
  for (const auto& [key, value] : metadata) {
    // PNG's limit for a key; a time stamp would make equal pictures different files.
    if (key.empty() || key.size() > 79 || key == "DateTime") {
      fail("{}: '{}' can't be a metadata key; allowed are 1 to 79 letters, and not DateTime", path.string(), key);
    }
    if (value.find('\0') != std::string::npos || key.find('\0') != std::string::npos) {
      fail("{}: the metadata '{}' has a zero byte", path.string(), key.c_str());
    }
  }
}

}  // namespace

void write_png(const fs::path& path, const cv::Mat& image, const ImageMetadata& metadata) {
  const bool depth_fits = image.depth() == CV_8U || image.depth() == CV_16U;
  const bool channels_fit = image.channels() == 1 || image.channels() == 3;
  if (image.empty() || image.dims != 2 || !depth_fits || !channels_fit) {
    fail("{}: a PNG takes a picture that isn't empty, of 8 or 16 bit, with 1 or 3 channels", path.string());
  }
  refuse_bad_metadata(path, metadata);
  cv::Mat pixels;  // cvtColor would turn the caller's picture round if this shared its memory
  const bool colour = image.channels() == 3;
  if (colour) {
    cv::cvtColor(image, pixels, cv::COLOR_BGR2RGB);
  } else {
    pixels = image;
  }
  const std::vector<std::string> names =
      colour ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"Y"};
  write_file(path, "png", image.depth() == CV_8U ? kTouchstoneU8 : kTouchstoneU16, pixels, names, metadata);
}

void write_exr(const fs::path& path, const cv::Mat& image, const std::vector<std::string>& channel_names,
               const ImageMetadata& metadata) {
  if (image.empty() || image.dims != 2 || image.depth() != CV_32F) {
    fail("{}: an EXR takes a picture of 32 bit floats that isn't empty", path.string());
  }
  if (channel_names.size() != static_cast<std::size_t>(image.channels())) {
    fail("{}: {} channel names for {} channels", path.string(), channel_names.size(), image.channels());
  }
  std::set<std::string> seen;
  for (const std::string& name : channel_names) {
    if (name.empty() || name.size() > 255 || name.find('\0') != std::string::npos || !seen.insert(name).second) {
      fail("{}: '{}' can't be a channel's name; each needs one of its own", path.string(), name.c_str());
    }
  }
  refuse_bad_metadata(path, metadata);
  write_file(path, "openexr", kTouchstoneFloat, image, channel_names, metadata);
}

cv::Mat read_image(const fs::path& path) {
  const Picture picture = read_file(path, "", true);
  if (picture.pixels.depth() == CV_32F) {
    fail("{}: holds floats; a picture of 8 or 16 bit is needed here", path.string());
  }
  const cv::Mat pixels = upright(picture.pixels, picture.orientation);
  cv::Mat image;
  switch (pixels.channels()) {
    case 1:
      return pixels;
    case 2:  // grey and alpha
      cv::extractChannel(pixels, image, 0);
      return image;
    case 3:
      cv::cvtColor(pixels, image, cv::COLOR_RGB2BGR);
      return image;
    case 4:
      cv::cvtColor(pixels, image, cv::COLOR_RGBA2BGR);
      return image;
    default:
      fail("{}: has {} channels; allowed is up to 4", path.string(), pixels.channels());
  }
}

LinearImage read_exr(const fs::path& path) {
  Picture picture = read_file(path, "", true);
  if (picture.pixels.depth() != CV_32F) fail("{}: doesn't hold floats", path.string());
  return {std::move(picture.pixels), std::move(picture.names)};
}

std::string image_metadata(const fs::path& path, const std::string& key) {
  return read_file(path, key, false).metadata_value;
}

}  // namespace touchstone::sim
