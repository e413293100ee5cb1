#include "datasets/sources/video_frames.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <thread>
#include <utility>

#include "core/input_file.h"
#include "core/units.h"
#include "datasets/sources/opened_video_module.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 3> kSchemes = {"http://", "https://", "rtsp://"};
constexpr std::size_t kMostWaiting = 8;  // frames of a live source that an estimator is behind
constexpr auto kLook = std::chrono::milliseconds(50);

/// An opened video, camera or address.
class OpenVideo {
 public:
  /// @param title in messages @param left asked while it waits @throws Error naming it if it can't be opened
  OpenVideo(const std::string& place, TouchstoneVideoKind kind, double timeout_s, const std::string& title,
            std::atomic<bool>* left) {
    const auto has_left = [](void* flag) { return flag != nullptr && *static_cast<std::atomic<bool>*>(flag) ? 1 : 0; };
    std::array<char, 512> message{};
    video_ =
        video_module().open(place.c_str(), kind, timeout_s, has_left, left, &info_, message.data(), message.size());
    if (video_ == nullptr) {
      fail("{}: can't be read {}: {}", title, kind == kTouchstoneVideoFile ? "as a video" : "from", message.data());
    }
  }
  ~OpenVideo() {
    if (video_ != nullptr) video_module().close(video_);
  }
  OpenVideo(const OpenVideo&) = delete;
  OpenVideo& operator=(const OpenVideo&) = delete;

  const TouchstoneVideoInfo& info() const { return info_; }

  /// False at the end. The frame's image isn't its own memory's. @throws Error if it can't go on
  bool read(TouchstoneVideoFrame& frame) {
    std::array<char, 512> message{};
    const int got = video_module().read(video_, &frame, message.data(), message.size());
    if (got < 0) fail("{}", message.data());
    return got > 0;
  }

 private:
  TouchstoneVideoInfo info_ = {};
  void* video_ = nullptr;
};

/// The frame's own picture, turned; with what is named after `stem` and `title`.
SourceFrame frame_from(const TouchstoneVideoFrame& from, int number, const std::string& stem,
                       const std::string& title) {
  SourceFrame frame;
  frame.label.frame = number;
  frame.label.timed = from.timed != 0;
  frame.label.t_us = frame.label.timed ? from.t_us : number;
  frame.stem = fmt::format("{}-{:06}", stem, number);
  frame.label.file = frame.stem;
  frame.title = fmt::format("{}: frame {}", title, number);
  if (from.pixels == nullptr) {
    frame.fault = fmt::format("{} {}", frame.title, from.fault);
    return frame;
  }
  const int type = CV_MAKETYPE(from.bits == 16 ? CV_16U : CV_8U, from.channels);
  const cv::Mat seen(from.height, from.width, type, const_cast<void*>(from.pixels), from.row_bytes);
  if (from.turned_deg == 0) {
    frame.image = seen.clone();
  } else {
    cv::rotate(seen, frame.image,
               from.turned_deg == 90    ? cv::ROTATE_90_CLOCKWISE
               : from.turned_deg == 180 ? cv::ROTATE_180
                                        : cv::ROTATE_90_COUNTERCLOCKWISE);
  }
  return frame;
}

class VideoFrames : public FrameSource {
 public:
  explicit VideoFrames(const std::string& file)
      : video_(fs::absolute(file).string(), kTouchstoneVideoFile, 0.0, file, nullptr),
        title_(file),
        stem_(fs::path(file).stem().string()) {}

  bool next(SourceFrame& frame) override {
    TouchstoneVideoFrame got{};
    if (!video_.read(got)) return false;
    frame = frame_from(got, number_++, stem_, title_);
    // A video whose clock stands still or goes back has no times that a tracker could take.
    if (frame.label.timed && frame.label.t_us <= last_us_ && number_ > 1) frame.label.t_us = last_us_ + 1;
    if (!frame.label.timed) frame.label.t_us = last_us_ + 1;
    last_us_ = frame.label.t_us;
    return true;
  }
  const TouchstoneVideoInfo& info() const { return video_.info(); }

 private:
  OpenVideo video_;
  std::string title_, stem_;
  int number_ = 0;
  std::int64_t last_us_ = -1;
};

/// Opens a live source and takes its frames as they come, in a thread of its own, so that none waits long and gets a
/// wrong time, and so that who waits for one can be stopped.
class LiveFrames : public FrameSource {
 public:
  LiveFrames(std::string place, TouchstoneVideoKind kind, std::string title, std::string stem, LivePatience patience)
      : place_(std::move(place)),
        kind_(kind),
        title_(std::move(title)),
        stem_(std::move(stem)),
        patience_(std::move(patience)) {
    taker_ = std::thread([this] { take(); });
  }
  ~LiveFrames() override {
    left_ = true;
    taker_.join();
  }

  bool next(SourceFrame& frame) override {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      if (patience_.stopped && patience_.stopped()) return false;
      if (!waiting_.empty() || ended_) break;
      came_.wait_for(lock, kLook);
    }
    if (!waiting_.empty()) {
      frame = std::move(waiting_.front());
      waiting_.pop_front();
      return true;
    }
    if (end_.empty()) return false;
    if (!opened_) fail("{}", end_);
    frame = {};
    frame.label.frame = number_;
    frame.label.timed = false;
    frame.label.t_us = last_us_ + 1;
    frame.stem = fmt::format("{}-{:06}", stem_, number_);
    frame.label.file = frame.stem;
    frame.title = fmt::format("{}: frame {}", title_, number_);
    frame.fault = fmt::format("{} isn't there: {}", frame.title, std::exchange(end_, ""));
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;

  void take() {
    std::string end;
    try {
      OpenVideo video(place_, kind_, patience_.timeout_s, title_, &left_);
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        opened_ = true;
      }
      for (TouchstoneVideoFrame got{}; video.read(got) && !left_;) put(got);
    } catch (const Error& error) {
      end = error.what();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    end_ = end;
    ended_ = true;
    came_.notify_one();
  }

  void put(TouchstoneVideoFrame got) {
    const Clock::time_point now = Clock::now();
    if (number_ == 0) first_ = now;
    got.timed = 1;
    got.t_us = std::max<std::int64_t>(last_us_ + 1,
                                      std::chrono::duration_cast<std::chrono::microseconds>(now - first_).count());
    SourceFrame frame = frame_from(got, number_, stem_, title_);
    const std::lock_guard<std::mutex> lock(mutex_);
    ++number_;
    last_us_ = got.t_us;
    if (waiting_.size() == kMostWaiting) waiting_.pop_front();
    waiting_.push_back(std::move(frame));
    came_.notify_one();
  }

  const std::string place_;
  const TouchstoneVideoKind kind_;
  const std::string title_, stem_;
  const LivePatience patience_;
  std::atomic<bool> left_{false};
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<SourceFrame> waiting_;
  int number_ = 0;  // only the taker changes it and the next two
  std::int64_t last_us_ = -1;
  Clock::time_point first_;
  bool opened_ = false, ended_ = false;
  std::string end_;
  std::thread taker_;
};

FrameStream live_stream(const std::string& place, TouchstoneVideoKind kind, const std::string& title,
                        const std::string& name, const LivePatience& patience) {
  FrameStream stream;
  stream.name = name;
  stream.live = true;
  stream.open = [=] { return std::make_unique<LiveFrames>(place, kind, title, name, patience); };
  return stream;
}

}  // namespace

FrameStream video_stream(const std::string& file) {
  const InputFile there(file);
  if (there.size() == 0) fail("{}: is empty; a video is needed here", file);
  FrameStream stream;
  stream.name = fs::path(file).stem().string();
  const TouchstoneVideoInfo info = VideoFrames(file).info();
  if (info.frames > 0) stream.frames = info.frames;
  if (info.frames == 0 && info.duration_s > 0.0 && info.frame_rate_Hz > 0.0) {
    stream.frames = std::max<std::int64_t>(1, std::llround(info.duration_s * info.frame_rate_Hz));
  }
  stream.open = [file] { return std::make_unique<VideoFrames>(file); };
  return stream;
}

FrameStream camera_stream(int number, const LivePatience& patience) {
  const std::string device = fmt::format("/dev/video{}", number);
  std::error_code ignored;
  if (!fs::exists(device, ignored)) {
    std::string there;
    for (int other = 0; other < 64; ++other) {
      if (fs::exists(fmt::format("/dev/video{}", other), ignored)) there += fmt::format(" {}", other);
    }
    fail("camera {}: there is no {}; this machine's cameras are:{}", number, device, there.empty() ? " none" : there);
  }
  return live_stream(std::to_string(number), kTouchstoneCamera, fmt::format("camera {}", number),
                     fmt::format("camera{}", number), patience);
}

FrameStream address_stream(const std::string& address, const LivePatience& patience) {
  return live_stream(address, kTouchstoneVideoAddress, address, "stream", patience);
}

bool is_address(const std::string& place) {
  const std::size_t end = place.find("://");
  if (end == std::string::npos || place.find('/') < end) return false;
  for (const char* scheme : kSchemes) {
    if (place.starts_with(scheme)) return true;
  }
  fail("{}: '{}' isn't read from; allowed are {}", place, place.substr(0, end + 3), fmt::join(kSchemes, ", "));
}

}  // namespace touchstone::datasets
