#pragma once
// The border between the program and its image module, which alone links OpenImageIO and is opened with dlopen by
// sim/files/image_file.cpp. Plain C types only: the two sides share no C++ objects. Internal to sim.

#include <cstddef>

extern "C" {

/// Of a channel: 8 bit, 16 bit or float.
enum TouchstoneDepth { kTouchstoneU8 = 0, kTouchstoneU16 = 1, kTouchstoneFloat = 2 };

/// Pixels to write; rows top down, channels interleaved in the file's order (RGB).
struct TouchstoneImageToWrite {
  const char* format;  // OpenImageIO's name: "png", "openexr"
  const char* path;
  int width, height, channels;
  TouchstoneDepth depth;
  const void* pixels;
  std::size_t row_bytes;
  const char* const* channel_names;  // `channels` names
  int metadata_count;
  const char* const* metadata_keys;
  const char* const* metadata_values;
};

/// What a file holds, as its reader learns before pixels are read.
struct TouchstoneImageInfo {
  int width, height, channels;
  TouchstoneDepth depth;
  const char* const* channel_names;
  const char* metadata_value;  // of the key asked for; "" if there's none
  int orientation;             // as EXIF's: 1 upright, 2 to 8 mirrored or turned; 1 where the file says nothing
};

/// The functions of the module, found by kTouchstoneImageModuleSymbol.
struct TouchstoneImageModule {
  int version;
  /// 0 if it worked, else `message` says why not.
  int (*write)(const TouchstoneImageToWrite* image, char* message, std::size_t message_size);
  /// Tells `accept` what the file holds; that returns where its pixels (packed, in the file's own depth) shall go, or
  /// null if they aren't wanted. 0 if it worked.
  int (*read)(const char* path, const char* metadata_key,
              void* (*accept)(void* context, const TouchstoneImageInfo* info), void* context, char* message,
              std::size_t message_size);
};

constexpr int kTouchstoneImageModuleVersion =
    2;  ///< changes with any of these structs; a module of another version isn't used
constexpr const char* kTouchstoneImageModuleSymbol =
    "touchstone_image_module_table";  ///< the module's function that returns its table
}
