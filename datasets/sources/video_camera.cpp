// Cameras of this machine, by OpenCV's videoio.

#include <cstdlib>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>

#include "datasets/sources/video_reader.h"

namespace touchstone {
namespace {

/// OpenCV prints what goes wrong; here it's an error's text.
class Silence {
 public:
  Silence() : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~Silence() { cv::utils::logging::setLogLevel(before_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  cv::utils::logging::LogLevel before_;
};

class Camera : public VideoInput {
 public:
  explicit Camera(const VideoPatience& patience) : patience_(patience) {}

  /// Null unless it opens.
  static std::unique_ptr<Camera> opened(int number, const VideoPatience& patience, TouchstoneVideoInfo& info) {
    const Silence silence;
    auto camera = std::make_unique<Camera>(patience);
    if (!camera->capture_.open(number, cv::CAP_V4L2)) return nullptr;
    info.frame_rate_Hz = camera->capture_.get(cv::CAP_PROP_FPS);
    return camera;
  }

  int read(TouchstoneVideoFrame& frame, std::string& message) override {
    if (patience_.ended()) return 0;
    bool got = false;
    {
      const Silence silence;
      got = capture_.read(picture_);
    }
    if (patience_.ended()) return 0;
    if (!got || picture_.empty()) {
      message = "gives no more frames";
      return -1;
    }
    frame = {.pixels = picture_.data,
             .row_bytes = picture_.step[0],
             .width = picture_.cols,
             .height = picture_.rows,
             .channels = picture_.channels(),
             .bits = picture_.depth() == CV_16U ? 16 : 8,
             .turned_deg = 0,
             .timed = 0,
             .t_us = 0,
             .fault = nullptr};
    return 1;
  }

 private:
  VideoPatience patience_;
  cv::VideoCapture capture_;
  cv::Mat picture_;
};

}  // namespace

std::unique_ptr<VideoInput> open_camera(const std::string& number, const VideoPatience& patience,
                                        TouchstoneVideoInfo& info, std::string& message) {
  // What OpenCV reads once, at the first camera: how long a frame is waited for.
  setenv("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", std::to_string(static_cast<int>(patience.timeout_s) + 1).c_str(), 0);
  auto camera = Camera::opened(std::atoi(number.c_str()), patience, info);
  if (!camera) message = "can't be opened";
  return camera;
}

}  // namespace touchstone
