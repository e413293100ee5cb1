#include "datasets/sources/video_file.h"

#include <array>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/sources/opened_video_module.h"

namespace touchstone::datasets {
namespace {

constexpr double kLeastInterval_us = 1e6 / 60.0;
constexpr std::int64_t kUsualInterval_us = 40'000;

}  // namespace

struct VideoFile::Parts {
  explicit Parts(const std::filesystem::path& path) : file(path), whole(path) {}
  ~Parts() {
    if (output != nullptr) video_module().drop(output);
  }

  void write(const cv::Mat& picture, std::int64_t t_us) {
    std::array<char, 512> message{};
    if (output == nullptr) {
      size = picture.size();
      output = video_module().create(std::filesystem::absolute(whole.temporary()).c_str(), size.width, size.height,
                                     message.data(), message.size());
      if (output == nullptr) fail("{}: can't be written as a video: {}", file.string(), message.data());
    }
    cv::Mat scaled = picture;
    if (picture.size() != size) cv::resize(picture, scaled, size, 0.0, 0.0, cv::INTER_AREA);
    if (video_module().add(output, scaled.data, scaled.step[0], t_us, message.data(), message.size()) != 0) {
      fail("{}: {}", file.string(), message.data());
    }
  }

  std::filesystem::path file;
  WholeFileWriter whole;
  void* output = nullptr;
  cv::Size size;
  cv::Mat first;                           ///< until the second one's time is known
  std::optional<std::int64_t> first_t_us;  ///< its time
  std::optional<std::int64_t> origin_us;   ///< of this sequence's clock
  std::int64_t shown_us = 0;               ///< when the last one is
  std::int64_t sequence_from_us = 0;       ///< when this sequence begins
  double slowed = 1.0;
  bool second_seen = false;
};

VideoFile::VideoFile(const std::filesystem::path& file) {
  require_video_name(file);
  parts_ = std::make_unique<Parts>(file);
}

VideoFile::~VideoFile() = default;

void VideoFile::add(const cv::Mat& picture, std::optional<std::int64_t> t_us) {
  Parts& p = *parts_;
  if (picture.type() != CV_8UC3 || picture.empty()) fail("{}: a picture isn't of 8 bit and BGR", p.file.string());
  if (p.first.empty() && !p.second_seen) {
    p.first = picture.clone();
    p.first_t_us = p.origin_us = t_us;
    return;
  }
  if (!p.second_seen) {
    p.second_seen = true;
    if (t_us && p.first_t_us && *t_us > *p.first_t_us) {
      const auto interval = static_cast<double>(*t_us - *p.first_t_us);
      if (interval < kLeastInterval_us) p.slowed = static_cast<double>(kUsualInterval_us) / interval;
    }
    p.write(std::exchange(p.first, {}), 0);
  }
  std::int64_t at = p.shown_us + kUsualInterval_us;
  if (t_us && p.origin_us) {
    const auto since = static_cast<std::int64_t>(p.slowed * static_cast<double>(*t_us - *p.origin_us));
    if (p.sequence_from_us + since > p.shown_us) {
      at = p.sequence_from_us + since;
    } else {
      p.origin_us = t_us;  // another sequence
      p.sequence_from_us = at;
    }
  }
  p.write(picture, at);
  p.shown_us = at;
}

void VideoFile::finish() {
  Parts& p = *parts_;
  if (!p.first.empty()) p.write(std::exchange(p.first, {}), 0);
  if (p.output == nullptr) return;
  std::array<char, 512> message{};
  if (video_module().finish(p.output, message.data(), message.size()) != 0) {
    fail("{}: {}", p.file.string(), message.data());
  }
  p.whole.finish();
}

double VideoFile::slowed() const {
  return parts_->slowed;
}

void require_video_name(const std::filesystem::path& file) {
  if (file.extension() != ".mp4") fail("{}: a video's name must end in .mp4", file.string());
}

}  // namespace touchstone::datasets
