#include "sensors/events/event_file_dsec.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone-events";
constexpr std::int64_t kFormatVersion = 2;  // 1 had arrays of its own: events/t_us, x, y, on
constexpr std::int64_t kLargestSide = 65536;
constexpr std::int64_t kMostUs = std::numeric_limits<std::uint32_t>::max();
constexpr std::int64_t kMs = 1000;
constexpr std::array kColumns{"/events/t", "/events/x", "/events/y", "/events/p"};

std::filesystem::path probed(const std::filesystem::path& file) {
  try_hdf5(file, [&file] {
    const Hdf5Reader reader(file);
    if (reader.has_attribute("/", "format")) reader.text_attribute("/", "format");
    for (const char* column : kColumns) {
      if (reader.has(column)) reader.walk_list(column);
    }
    if (reader.has("/t_offset")) reader.read_number("/t_offset");
  });
  return file;
}

}  // namespace

DsecEventReader::DsecEventReader(const std::filesystem::path& file, const EventReadOptions& options)
    : name_(file.string()),
      file_(probed(file)),
      check_(name_, options.size.value_or(cv::Size(static_cast<int>(kLargestSide), static_cast<int>(kLargestSide)))) {
  source_.format = EventFormat::dsec;
  source_.size = options.size;
  if (file_.has_attribute("/", "format")) {
    if (const std::string format = file_.text_attribute("/", "format"); format != kFormat) {
      fail("{}: isn't a file of events but of format '{}'", name_, format);
    }
    const std::int64_t version = file_.integer_attribute("/", "format_version");
    if (version != kFormatVersion) {
      fail("{}: has format version {}; this program reads {}. Make it again, by the same scene or job", name_, version,
           kFormatVersion);
    }
    const std::int64_t width = file_.integer_attribute("/", "width");
    const std::int64_t height = file_.integer_attribute("/", "height");
    if (width < 1 || width > kLargestSide || height < 1 || height > kLargestSide) {
      fail("{}: its camera has {} x {} pixels; allowed is 1 to {}", name_, width, height, kLargestSide);
    }
    const cv::Size size(static_cast<int>(width), static_cast<int>(height));
    if (options.size && *options.size != size) {
      fail("{}: its camera has {} x {} pixels; {} x {} were expected", name_, width, height, options.size->width,
           options.size->height);
    }
    source_.size = size;
    check_ = EventCheck(name_, size);
  }
  count_ = file_.count_of_whole_numbers("/events/t");
  for (const char* column : kColumns) {
    if (const std::int64_t count = file_.count_of_whole_numbers(column); count != count_) {
      fail("{}: '{}' holds {} numbers and '/events/t' {}; they must be as many", name_, column, count, count_);
    }
  }
  if (file_.has("/t_offset")) offset_us_ = file_.read_number("/t_offset");
}

void DsecEventReader::read(std::vector<Event>& events) {
  const auto count = static_cast<std::size_t>(std::min<std::int64_t>(kEventPortion, count_ - source_.events));
  t_us_.resize(count);
  x_.resize(count);
  y_.resize(count);
  polarity_.resize(count);
  // Types of more than 16 bits, so that what doesn't fit shows.
  file_.read_part<std::int64_t>("/events/t", source_.events, t_us_);
  file_.read_part<std::int32_t>("/events/x", source_.events, x_);
  file_.read_part<std::int32_t>("/events/y", source_.events, y_);
  file_.read_part<std::int32_t>("/events/p", source_.events, polarity_);
  events.resize(count);
  const cv::Size size = check_.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t number = source_.events + static_cast<std::int64_t>(i);
    if (x_[i] < 0 || x_[i] >= size.width || y_[i] < 0 || y_[i] >= size.height) {
      fail("{}: event {} is at column {}, row {}; allowed are columns 0 to {} and rows 0 to {}", name_, number, x_[i],
           y_[i], size.width - 1, size.height - 1);
    }
    if (polarity_[i] < -1 || polarity_[i] > 1) {
      fail("{}: event {} has polarity {}; allowed is 1 for ON, 0 or -1 for OFF", name_, number, polarity_[i]);
    }
    std::int64_t t_us = 0;
    if (__builtin_add_overflow(t_us_[i], offset_us_, &t_us)) {
      fail("{}: event {} is at {} us + {} us, which 64 bits don't hold", name_, number, t_us_[i], offset_us_);
    }
    events[i] = {t_us, static_cast<std::uint16_t>(x_[i]), static_cast<std::uint16_t>(y_[i]), polarity_[i] == 1};
  }
  check_.pass(events);
  source_.events += static_cast<std::int64_t>(count);
}

DsecEventWriter::DsecEventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program)
    : name_(file.string()), file_(file) {
  file_.set_attribute("format", kFormat);
  file_.set_attribute("format_version", kFormatVersion);
  file_.set_attribute("program", program);
  file_.set_attribute("width", std::int64_t{size.width});
  file_.set_attribute("height", std::int64_t{size.height});
  file_.add_growing<std::uint8_t>({"/events/p", "1", "events", "", "1 where the light grew, 0 where it fell."});
  file_.add_growing<std::uint16_t>({"/events/x", "pixels", "events", "", "Column, from 0 at the left."});
  file_.add_growing<std::uint16_t>({"/events/y", "pixels", "events", "", "Row, from 0 at the top."});
  file_.add_growing<std::uint32_t>({"/events/t", "us", "events", "", "Time, to which t_offset is to be added."});
}

void DsecEventWriter::append(std::span<const Event> events) {
  if (events.empty()) return;
  if (count_ == 0) {
    const std::int64_t first_us = events.front().t_us;
    const std::int64_t into_ms = ((first_us % kMs) + kMs) % kMs;
    offset_us_ = first_us >= 0 && first_us <= kMostUs ? 0 : first_us - into_ms;
  }
  t_us_.clear();
  x_.clear();
  y_.clear();
  on_.clear();
  for (const Event& event : events) {
    const std::int64_t t_us = event.t_us - offset_us_;
    if (t_us > kMostUs) {
      fail("{}: event {} comes {} us after the file's begin; DSEC's 32 bits hold {}: write .raw, .aedat4 or .txt",
           name_, count_, t_us, kMostUs);
    }
    // By the layout: t[ms_to_idx[ms]] >= ms * 1000 and t[ms_to_idx[ms] - 1] < ms * 1000.
    const auto milliseconds = static_cast<std::size_t>(t_us / kMs) + 1;
    if (first_of_ms_.size() < milliseconds) first_of_ms_.resize(milliseconds, count_);
    t_us_.push_back(static_cast<std::uint32_t>(t_us));
    x_.push_back(event.x);
    y_.push_back(event.y);
    on_.push_back(event.on ? 1 : 0);
    ++count_;
  }
  file_.append<std::uint8_t>("/events/p", on_);
  file_.append<std::uint16_t>("/events/x", x_);
  file_.append<std::uint16_t>("/events/y", y_);
  file_.append<std::uint32_t>("/events/t", t_us_);
}

void DsecEventWriter::close() {
  file_.write<std::uint64_t>({"/ms_to_idx", "1", "milliseconds", "", "The first event not before each millisecond."},
                             static_cast<std::int64_t>(first_of_ms_.size()), {}, first_of_ms_);
  file_.write_number({"/t_offset", "us", "", "", "To be added to events/t."}, offset_us_);
  file_.close();
}

}  // namespace touchstone::sensors
