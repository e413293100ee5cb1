#include "datasets/sources/frame_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <optional>
#include <utility>

#include "core/error.h"

namespace touchstone::datasets {
namespace {

constexpr std::size_t kIntervals = 15;  // of which the middle one is the usual
constexpr std::size_t kFewest = 5;
constexpr double kGap = 1.6;  // of the usual interval: half a frame more than one, and some jitter

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || a.size() != b.size() || a.type() != b.type()) return false;
  const std::size_t row_bytes = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), row_bytes) != 0) return false;
  }
  return true;
}

void note(std::vector<std::string>& notes, std::string what) {
  if (std::ranges::find(notes, what) == notes.end()) notes.push_back(std::move(what));
}

class WatchedFrames : public FrameSource {
 public:
  WatchedFrames(std::unique_ptr<FrameSource> source, std::shared_ptr<FrameNotes> notes)
      : source_(std::move(source)), notes_(std::move(notes)) {}

  bool next(SourceFrame& frame) override {
    if (!source_->next(frame)) return false;
    if (frame.label.timed) look_at_time(frame);
    if (!frame.fault.empty()) return true;
    if (same_bytes(frame.image, before_)) note(notes_->doubled, frame.title);
    before_ = frame.image.clone();  // who takes the frame may draw into it
    return true;
  }

 private:
  void look_at_time(const SourceFrame& frame) {
    const std::optional<std::int64_t> before = std::exchange(before_us_, frame.label.t_us);
    if (!before) return;
    const auto interval = static_cast<double>(frame.label.t_us - *before);
    if (intervals_.size() >= kFewest) {
      std::vector<double> sorted(intervals_.begin(), intervals_.end());
      const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
      std::nth_element(sorted.begin(), middle, sorted.end());
      if (interval > kGap * *middle) {
        const auto missing = std::max(1LL, std::llround(interval / *middle) - 1);
        note(notes_->gaps, fmt::format("{}: about {} missing before it", frame.title,
                                       missing == 1 ? "one frame is" : fmt::format("{} frames are", missing)));
      }
    }
    intervals_.push_back(interval);
    if (intervals_.size() > kIntervals) intervals_.pop_front();
  }

  std::unique_ptr<FrameSource> source_;
  std::shared_ptr<FrameNotes> notes_;
  cv::Mat before_;
  std::optional<std::int64_t> before_us_;
  std::deque<double> intervals_;
};

}  // namespace

FrameStream watched(FrameStream stream, std::shared_ptr<FrameNotes> notes) {
  TS_ASSERT(notes != nullptr);
  stream.open = [notes = std::move(notes), opened = std::move(stream.open)] {
    return std::make_unique<WatchedFrames>(opened(), notes);
  };
  return stream;
}

}  // namespace touchstone::datasets
