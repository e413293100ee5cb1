#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

namespace touchstone::render {

/// How finely a JPEG keeps colour beside brightness.
enum class JpegChroma : std::uint8_t {
  full,    ///< 4:4:4: each pixel has its own
  quarter  ///< 4:2:0: one for each 2x2 pixels
};

/// How a picture is encoded: 1 to 100, on the scale of the Independent JPEG Group, as all of libjpeg's kin have it.
struct JpegSettings {
  int quality = 90;
  JpegChroma chroma = JpegChroma::full;  ///< of a picture with colours
};

/// @throws Error for a quality that isn't from 1 to 100
void check(const JpegSettings& settings);

/// A picture as the bytes of a JPEG file, by libjpeg-turbo. The same picture gives the same bytes.
/// @param image 8 bit, one channel (grey) or three (BGR)
/// @throws Error for a picture of another type, an empty one, one with a side above 65535, or as check
std::string jpeg_bytes(const cv::Mat& image, const JpegSettings& settings);

/// What is left of a picture that is encoded and decoded, in the same size and type. @throws Error as jpeg_bytes
cv::Mat through_jpeg(const cv::Mat& image, const JpegSettings& settings);

}  // namespace touchstone::render
