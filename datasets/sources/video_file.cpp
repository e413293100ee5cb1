#include "datasets/sources/video_file.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/whole_file_writer.h"
#include "datasets/sources/opened_video_module.h"

namespace touchstone::datasets {
namespace {

constexpr double kLeastInterval_us = 1e6 / 60.0;
constexpr std::int64_t kUsualInterval_us = 40'000;
constexpr std::size_t kHeld = 6;  // pictures, whose usual interval says how fast it is to be shown

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

  /// Finds how fast it is to be shown, and writes what was held for that.
  void begin() {
    std::vector<std::int64_t> intervals;
    for (std::size_t i = 1; i < held.size(); ++i) {
      if (held[i].t_us && held[i - 1].t_us && *held[i].t_us > *held[i - 1].t_us) {
        intervals.push_back(*held[i].t_us - *held[i - 1].t_us);
      }
    }
    if (!intervals.empty()) {
      const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
      std::nth_element(intervals.begin(), middle, intervals.end());
      const auto usual = static_cast<double>(*middle);
      if (usual < kLeastInterval_us) slowed = static_cast<double>(kUsualInterval_us) / usual;
    }
    begun = true;
    for (const Held& one : std::exchange(held, {})) show(one.picture, one.t_us);
  }

  void show(const cv::Mat& picture, std::optional<std::int64_t> t_us) {
    std::int64_t at = output == nullptr ? 0 : shown_us + kUsualInterval_us;
    if (output == nullptr) origin_us = t_us;
    if (output != nullptr && t_us && origin_us) {
      const auto since = static_cast<std::int64_t>(slowed * static_cast<double>(*t_us - *origin_us));
      if (sequence_from_us + since > shown_us) {
        at = sequence_from_us + since;
      } else {
        origin_us = t_us;  // another sequence
        sequence_from_us = at;
      }
    }
    write(picture, at);
    shown_us = at;
  }

  struct Held {
    cv::Mat picture;
    std::optional<std::int64_t> t_us;
  };

  std::filesystem::path file;
  WholeFileWriter whole;
  void* output = nullptr;
  cv::Size size;
  bool begun = false;
  std::vector<Held> held;                 ///< the first ones, until it has begun
  std::optional<std::int64_t> origin_us;  ///< of this sequence's clock
  std::int64_t shown_us = 0;              ///< when the last one is
  std::int64_t sequence_from_us = 0;      ///< when this sequence begins
  double slowed = 1.0;
};

VideoFile::VideoFile(const std::filesystem::path& file) {
  require_video_name(file);
  parts_ = std::make_unique<Parts>(file);
}

VideoFile::~VideoFile() = default;

void VideoFile::add(const cv::Mat& picture, std::optional<std::int64_t> t_us) {
  Parts& p = *parts_;
  if (picture.type() != CV_8UC3 || picture.rows < 2 || picture.cols < 2) {
    fail("{}: a picture isn't of 8 bit and BGR, or has less than 2 x 2 pixels", p.file.string());
  }
  if (p.begun) return p.show(picture, t_us);
  p.held.push_back({picture.clone(), t_us});
  if (p.held.size() == kHeld) p.begin();
}

void VideoFile::finish() {
  Parts& p = *parts_;
  if (!p.begun) p.begin();
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
