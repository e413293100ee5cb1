#include "render/imager/jpeg.h"

#include <turbojpeg.h>

#include <memory>

#include "core/error.h"

namespace touchstone::render {
namespace {

using Handle = std::unique_ptr<void, int (*)(tjhandle)>;

}  // namespace

void check(const JpegSettings& settings) {
  if (settings.quality < 1 || settings.quality > 100) fail("JPEG quality {}; allowed is 1 to 100", settings.quality);
}

std::string jpeg_bytes(const cv::Mat& image, const JpegSettings& settings) {
  if (image.empty() || (image.type() != CV_8UC1 && image.type() != CV_8UC3)) {
    fail("a JPEG is made of a picture of 8 bits with one or three channels, not of {} x {} with {} channels",
         image.cols, image.rows, image.channels());
  }
  check(settings);
  const Handle compressor(tjInitCompress(), &tjDestroy);
  const bool grey = image.channels() == 1;
  const int colours = settings.chroma == JpegChroma::full ? TJSAMP_444 : TJSAMP_420;
  unsigned char* made = nullptr;
  unsigned long size = 0;
  const int failed = tjCompress2(compressor.get(), image.data, image.cols, static_cast<int>(image.step[0]), image.rows,
                                 grey ? TJPF_GRAY : TJPF_BGR, &made, &size, grey ? TJSAMP_GRAY : colours,
                                 settings.quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> bytes(made, &tjFree);
  if (failed != 0)
    fail("a JPEG of {} x {} pixels can't be made: {}", image.cols, image.rows, tjGetErrorStr2(compressor.get()));
  return std::string(reinterpret_cast<const char*>(bytes.get()), size);
}

cv::Mat through_jpeg(const cv::Mat& image, const JpegSettings& settings) {
  const std::string bytes = jpeg_bytes(image, settings);
  const Handle decompressor(tjInitDecompress(), &tjDestroy);
  cv::Mat decoded(image.size(), image.type());
  const int failed = tjDecompress2(decompressor.get(), reinterpret_cast<const unsigned char*>(bytes.data()),
                                   static_cast<unsigned long>(bytes.size()), decoded.data, decoded.cols,
                                   static_cast<int>(decoded.step[0]), decoded.rows,
                                   image.channels() == 1 ? TJPF_GRAY : TJPF_BGR, TJFLAG_ACCURATEDCT);
  if (failed != 0) {
    fail("a JPEG of {} x {} pixels can't be decoded: {}", image.cols, image.rows, tjGetErrorStr2(decompressor.get()));
  }
  return decoded;
}

}  // namespace touchstone::render
