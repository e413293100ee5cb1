#include "datasets/sources/frame_times.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/units.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

constexpr double kLatest_s = 9.0e12;  // of what whole microseconds hold

/// A stream whose frames `change` sees in their order. It returns false for a frame that is passed over.
using Change = std::function<bool(SourceFrame&)>;

class ChangedFrames : public FrameSource {
 public:
  /// @param at_end asked once when there are no more: says what is wrong with that, or ""
  ChangedFrames(std::unique_ptr<FrameSource> source, Change change, std::function<std::string()> at_end)
      : source_(std::move(source)), change_(std::move(change)), at_end_(std::move(at_end)) {}

  bool next(SourceFrame& frame) override {
    while (source_->next(frame)) {
      last_ = {frame.label, frame.stem, frame.title, {}, {}};
      if (change_(frame)) return true;
    }
    if (!at_end_) return false;
    const std::string fault = std::exchange(at_end_, nullptr)();
    if (fault.empty()) return false;
    frame = last_;
    ++frame.label.frame;
    ++frame.label.t_us;
    frame.label.timed = false;
    frame.fault = fault;
    return true;
  }

 private:
  std::unique_ptr<FrameSource> source_;
  Change change_;
  std::function<std::string()> at_end_;
  SourceFrame last_;
};

std::int64_t seconds_to_us(double seconds, const SourceLocation& where) {
  if (std::abs(seconds) > kLatest_s)
    fail_at(where, "t_s: {} is out of bounds, {} to {}", seconds, -kLatest_s, kLatest_s);
  return std::llround(seconds * kMicrosecondsPerSecond);
}

}  // namespace

FrameTimes read_frame_times(const fs::path& csv) {
  const std::string head = header_among(csv, {"file,t_us", "file,t_s", "frame,t_us", "frame,t_s"});
  FrameTimes times;
  times.csv = csv;
  times.by_file = head.starts_with("file");
  const bool seconds = head.ends_with("t_s");
  std::optional<std::int64_t> before;
  for_each_row(csv, head, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    const std::int64_t t_us = seconds ? seconds_to_us(number_in(cells[1], "t_s", where), where)
                                      : whole_number_in<std::int64_t>(cells[1], "t_us", where);
    if (before && t_us <= *before) {
      fail_at(where, "{}: {} isn't later than the line before", seconds ? "t_s" : "t_us", cells[1]);
    }
    before = t_us;
    const std::pair<std::int64_t, int> value{t_us, where.line};
    if (times.by_file) {
      const auto [one, is_new] = times.of_file.emplace(cells[0], value);
      if (!is_new) fail_at(where, "file: '{}' stands in line {}, too", cells[0], one->second.second);
      return;
    }
    const auto number = whole_number_in<std::int64_t>(cells[0], "frame", where);
    if (number < 0) fail_at(where, "frame: {} must be 0 or more", number);
    if (!times.of_frame.empty() && number <= times.of_frame.rbegin()->first) {
      fail_at(where, "frame: {} doesn't come after the line before", number);
    }
    times.of_frame.emplace(number, value);
  });
  return times;
}

FrameStream with_times(FrameStream stream, const FrameTimes& times) {
  if (times.by_file) {
    fail_at({times.csv.string(), 1}, "the frames of {} have no files of their own; 'frame' is needed for 'file'",
            stream.name);
  }
  const auto shared = std::make_shared<const FrameTimes>(times);
  stream.open = [shared, opened = std::move(stream.open)] {
    const auto last = std::make_shared<std::int64_t>(-1);
    return std::make_unique<ChangedFrames>(
        opened(),
        [shared, last](SourceFrame& frame) {
          const auto found = shared->of_frame.find(frame.label.frame);
          *last = frame.label.frame;
          if (found == shared->of_frame.end()) {
            if (frame.fault.empty())
              frame.fault = fmt::format("{} has no line in {}", frame.title, shared->csv.string());
            return true;
          }
          frame.label.t_us = found->second.first;
          frame.label.timed = true;
          return true;
        },
        [shared, last] {
          const auto beyond = shared->of_frame.upper_bound(*last);
          if (beyond == shared->of_frame.end()) return std::string();
          return fmt::format("{}:{}: frame: there is no frame {}; the last one is {}", shared->csv.string(),
                             beyond->second.second, beyond->first, *last);
        });
  };
  return stream;
}

FrameSequence with_times(FrameSequence sequence, const FrameTimes& times) {
  std::size_t used = 0;
  std::optional<std::int64_t> before;
  for (LabelledFrame& frame : sequence.frames) {
    const std::string name = frame.file.filename().string();
    const std::pair<std::int64_t, int>* found = nullptr;
    if (times.by_file) {
      const auto at = times.of_file.find(name);
      if (at != times.of_file.end()) found = &at->second;
    } else {
      const auto at = times.of_frame.find(frame.frame);
      if (at != times.of_frame.end()) found = &at->second;
    }
    if (found == nullptr) fail("{}: has no line in {}", frame.file.string(), times.csv.string());
    if (before && found->first <= *before) {
      fail_at({times.csv.string(), found->second}, "{} isn't later than the frame before it in natural order of names",
              name);
    }
    before = found->first;
    frame.t_us = found->first;
    frame.timed = true;
    ++used;
  }
  if (times.by_file && used < times.of_file.size()) {
    for (const auto& [name, value] : times.of_file) {
      const bool there = std::ranges::any_of(
          sequence.frames, [&](const LabelledFrame& frame) { return frame.file.filename().string() == name; });
      if (!there)
        fail_at({times.csv.string(), value.second}, "file: there is no picture '{}' in {}", name, sequence.name);
    }
  }
  if (!times.by_file && used < times.of_frame.size()) {
    const auto beyond = times.of_frame.lower_bound(static_cast<std::int64_t>(sequence.frames.size()));
    fail_at({times.csv.string(), beyond->second.second}, "frame: there is no frame {}; there are {}", beyond->first,
            sequence.frames.size());
  }
  return sequence;
}

FrameStream with_rate(FrameStream stream, double rate_Hz) {
  if (!(rate_Hz > 0.0) || !std::isfinite(rate_Hz)) fail("a rate of {} Hz: it must be above 0", rate_Hz);
  stream.open = [rate_Hz, opened = std::move(stream.open)] {
    return std::make_unique<ChangedFrames>(
        opened(),
        [rate_Hz](SourceFrame& frame) {
          frame.label.t_us = std::llround(static_cast<double>(frame.label.frame) * kMicrosecondsPerSecond / rate_Hz);
          frame.label.timed = true;
          return true;
        },
        nullptr);
  };
  return stream;
}

FrameStream with_forces(FrameStream stream, std::vector<NumberedForce> forces, const fs::path& csv) {
  const auto shared = std::make_shared<const std::vector<NumberedForce>>(std::move(forces));
  stream.frames = static_cast<std::int64_t>(shared->size());
  stream.open = [shared, csv, opened = std::move(stream.open)] {
    const auto next = std::make_shared<std::size_t>(0);
    return std::make_unique<ChangedFrames>(
        opened(),
        [shared, next](SourceFrame& frame) {
          if (*next == shared->size() || (*shared)[*next].frame != frame.label.frame) return false;
          const NumberedForce& force = (*shared)[(*next)++];
          frame.label.t_us = force.t_us;
          frame.label.timed = true;
          frame.label.force = force.force;
          return true;
        },
        [shared, next, csv] {
          if (*next == shared->size()) return std::string();
          return fmt::format("{}:{}: frame: there is no frame {}", csv.string(), (*shared)[*next].line,
                             (*shared)[*next].frame);
        });
  };
  return stream;
}

FrameStream limited(FrameStream stream, std::int64_t most_frames, double most_s, std::function<bool()> stopped) {
  if (most_frames <= 0 && most_s <= 0.0 && !stopped) return stream;
  if (most_frames > 0) stream.frames = stream.frames ? std::min(*stream.frames, most_frames) : most_frames;
  if (most_s > 0.0) stream.frames.reset();
  class Limited : public FrameSource {
   public:
    Limited(std::unique_ptr<FrameSource> source, std::int64_t frames, double seconds, std::function<bool()> ended)
        : source_(std::move(source)), frames_(frames), seconds_(seconds), ended_(std::move(ended)) {}

    bool next(SourceFrame& frame) override {
      if ((frames_ > 0 && given_ == frames_) || (ended_ && ended_()) || !source_->next(frame)) return false;
      if (seconds_ > 0.0 && !frame.label.timed && frame.fault.empty()) {
        fail("{}: an end after {} s: the frames' times aren't known; a rate or a table of times says them", frame.title,
             seconds_);
      }
      if (seconds_ > 0.0 && frame.label.timed) {
        if (!first_us_) first_us_ = frame.label.t_us;
        if (static_cast<double>(frame.label.t_us - *first_us_) >= seconds_ * kMicrosecondsPerSecond) return false;
      }
      ++given_;
      return true;
    }

   private:
    std::unique_ptr<FrameSource> source_;
    std::int64_t frames_, given_ = 0;
    double seconds_;
    std::function<bool()> ended_;
    std::optional<std::int64_t> first_us_;
  };
  stream.open = [=, opened = std::move(stream.open)] {
    return std::make_unique<Limited>(opened(), most_frames, most_s, stopped);
  };
  return stream;
}

}  // namespace touchstone::datasets
