#pragma once
// Internal to the image module.

#include <string>

namespace touchstone {

/// What is damaged in an image file, as far as OpenImageIO must not see it; "" if nothing is, and for formats that
/// aren't looked at. Of a PNG: a chunk that its picture needs, up to its last pixels, is cut off, or isn't what its
/// checksum says; libpng would print a line of its own to standard error. Of an EXR: a note of its header is longer
/// than the file; OpenEXR would ask for as much memory as it says, up to 2 GB.
std::string image_damage(const char* path);

}  // namespace touchstone
