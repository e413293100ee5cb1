#pragma once
// Internal to the video module.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace touchstone {

/// A video that is written. Each function returns what went wrong, "" if nothing did.
class VideoOutput {
 public:
  VideoOutput();
  ~VideoOutput();
  VideoOutput(const VideoOutput&) = delete;
  VideoOutput& operator=(const VideoOutput&) = delete;

  /// Begins the file.
  std::string open(const std::string& file, int width, int height);
  /// A picture of that size. @param t_us when it's shown; moved on where it isn't after the one before
  std::string add(const unsigned char* bgr, std::size_t row_bytes, std::int64_t t_us);
  /// Brings all to the file.
  std::string finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace touchstone
