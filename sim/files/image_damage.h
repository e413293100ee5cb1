#pragma once
// Internal to the image module.

#include <string>

namespace touchstone {

/// Of a picture that is read: a file of 1 MB may stand for a thousand times as many.
inline constexpr long long kMostPixels = 100'000'000;

/// What is damaged in an image file, as far as OpenImageIO must not see it or doesn't; "" if nothing is, and for
/// formats that aren't looked at. Of a PNG: a chunk that its picture needs, up to its last pixels, is cut off, or isn't
/// what its checksum says; libpng would print a line of its own to standard error. Of a JPEG: its coded pixels end
/// early, can't be decoded, or are more than its size takes; OpenImageIO passes over libjpeg's warnings. Damage that
/// leaves a possible JPEG isn't found, as it has no checksums. Of a TIFF: a strip or tile is cut off, can't be decoded
/// or, if it is packed by zlib, isn't what its checksum says; OpenImageIO passes over all three. Of an EXR: a note of
/// its header is longer than the file; OpenEXR would ask for as much memory as it says, up to 2 GB.
std::string image_damage(const char* path);

}  // namespace touchstone
