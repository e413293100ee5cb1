#include "sim/files/jpeg_bytes.h"

#include <turbojpeg.h>

#include <memory>

#include "core/error.h"

namespace touchstone::sim {

std::string jpeg_bytes(const cv::Mat& image, int quality) {
  if (image.empty() || (image.type() != CV_8UC1 && image.type() != CV_8UC3)) {
    fail("a JPEG is made of a picture of 8 bits with one or three channels, not of {} x {} with {} channels",
         image.cols, image.rows, image.channels());
  }
  if (quality < 1 || quality > 100) fail("JPEG quality {}; allowed is 1 to 100", quality);
  const std::unique_ptr<void, int (*)(tjhandle)> compressor(tjInitCompress(), &tjDestroy);
  const bool grey = image.channels() == 1;
  unsigned char* made = nullptr;
  unsigned long size = 0;
  const int failed = tjCompress2(compressor.get(), image.data, image.cols, static_cast<int>(image.step[0]), image.rows,
                                 grey ? TJPF_GRAY : TJPF_BGR, &made, &size, grey ? TJSAMP_GRAY : TJSAMP_444, quality,
                                 TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> bytes(made, &tjFree);
  if (failed != 0)
    fail("a JPEG of {} x {} pixels can't be made: {}", image.cols, image.rows, tjGetErrorStr2(compressor.get()));
  return std::string(reinterpret_cast<const char*>(bytes.get()), size);
}

}  // namespace touchstone::sim
