#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace touchstone::sim {

/// A picture as the bytes of a JPEG file, by libjpeg-turbo with full colour resolution (4:4:4): for streams and pages,
/// not for data. The same picture gives the same bytes.
/// @param image 8 bit, one channel (grey) or three (BGR) @param quality 1 to 100
/// @throws Error for a picture of another type, an empty one, or another quality
std::string jpeg_bytes(const cv::Mat& image, int quality);

}  // namespace touchstone::sim
