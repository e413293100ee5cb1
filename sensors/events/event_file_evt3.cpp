#include "sensors/events/event_file_evt3.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/short_text.h"

namespace touchstone::sensors {
namespace {

// A word's upper four bits.
constexpr unsigned kAddrY = 0x0;
constexpr unsigned kAddrX = 0x2;
constexpr unsigned kVectBaseX = 0x3;
constexpr unsigned kVect12 = 0x4;
constexpr unsigned kVect8 = 0x5;
constexpr unsigned kTimeLow = 0x6;
constexpr unsigned kContinued4 = 0x7;
constexpr unsigned kTimeHigh = 0x8;
constexpr unsigned kExtTrigger = 0xA;
constexpr unsigned kOthers = 0xE;
constexpr unsigned kContinued12 = 0xF;

constexpr unsigned kPlace = 0x7FF;  // column or row: 11 bits
constexpr unsigned kOnBit = 0x800;
constexpr int kLargestSide = 2048;
constexpr int kTimeBits = 12;                                        // of each half
constexpr int kHighs = 1 << kTimeBits;                               // TIME_HIGH counts modulo this
constexpr std::int64_t kWrapUs = std::int64_t{kHighs} << kTimeBits;  // 16.777216 s
constexpr std::int64_t kMostOffsetUs = std::int64_t{1} << 62;
constexpr unsigned kVectorLength = 12;
constexpr unsigned kFarColumn = 1 << 15;  // no column; where a vector's base stays once it has left the picture
constexpr std::size_t kFlushBytes = 1 << 20;
constexpr const char* kOffsetKeyword = "touchstone_t_offset_us";

template <typename Number>
bool read_number(std::string_view text, Number& value) {
  const auto [at, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && at == text.data() + text.size();
}

std::int64_t wraps_down(std::int64_t t_us) {
  return t_us - (((t_us % kWrapUs) + kWrapUs) % kWrapUs);
}

}  // namespace

Evt3EventReader::Evt3EventReader(const std::filesystem::path& file, const EventReadOptions& options)
    : name_(file.string()), file_(map_file(file)), check_(name_, {kLargestSide, kLargestSide}) {
  source_.format = EventFormat::evt3;
  read_header(options);
  if ((file_.size - at_) % 2 != 0) {
    fail("{}: its {} bytes of events from byte {} on end within a word of two bytes: the file is broken off", name_,
         file_.size - at_, at_);
  }
}

void Evt3EventReader::take_header_line(const std::string& keyword, const std::string& value, int line) {
  const SourceLocation where{name_, line};
  const auto side = [&](std::string_view text, int& to) {
    if (!read_number(text, to) || to < 1 || to > kLargestSide) {
      fail_at(where, "{}: '{}' isn't a number of pixels; allowed is 1 to {}", keyword, short_text(text), kLargestSide);
    }
  };
  if (keyword == "evt") {
    if (value != "3.0") fail_at(where, "evt: '{}' isn't an encoding that is read; allowed is 3.0", short_text(value));
    is_evt3_ = true;
  } else if (keyword == "format") {  // EVT3;height=720;width=1280
    std::string_view rest = value;
    for (bool first = true; first || !rest.empty(); first = false) {
      const std::string_view part = rest.substr(0, rest.find(';'));
      rest.remove_prefix(std::min(rest.size(), part.size() + 1));
      if (first && part != "EVT3")
        fail_at(where, "format: '{}' isn't an encoding that is read; allowed is EVT3", short_text(part));
      if (part.starts_with("width=")) side(part.substr(6), width_);
      if (part.starts_with("height=")) side(part.substr(7), height_);
      if (part.starts_with("endianness=") && part.substr(11) != "little") {
        fail_at(where, "format: '{}' isn't read; allowed is little", short_text(part));
      }
    }
    is_evt3_ = true;
  } else if (keyword == "geometry") {  // 1280x720
    const std::size_t cross = value.find('x');
    if (cross == std::string::npos)
      fail_at(where, "geometry: '{}' isn't a size; allowed is 1280x720", short_text(value));
    side(std::string_view(value).substr(0, cross), width_);
    side(std::string_view(value).substr(cross + 1), height_);
  } else if (keyword == "width") {
    side(value, width_);
  } else if (keyword == "height") {
    side(value, height_);
  } else if (keyword == "endianness") {
    if (value != "little") fail_at(where, "endianness: '{}' isn't read; allowed is little", short_text(value));
  } else if (keyword == kOffsetKeyword) {
    if (!read_number(value, offset_us_) || offset_us_ % kWrapUs != 0 || offset_us_ < -kMostOffsetUs ||
        offset_us_ > kMostOffsetUs) {
      fail_at(where, "{}: '{}' isn't a multiple of {} us of at most {}", keyword, short_text(value), kWrapUs,
              kMostOffsetUs);
    }
  }
}

void Evt3EventReader::read_header(const EventReadOptions& options) {
  const std::string_view bytes(file_.bytes.get(), file_.size);
  int line = 0;
  while (bytes.substr(at_).starts_with("% ")) {
    ++line;
    const std::size_t end = bytes.find('\n', at_);
    if (end == std::string_view::npos) fail_at({name_, line}, "the header is broken off");
    std::string_view text = bytes.substr(at_ + 2, end - at_ - 2);
    if (text.ends_with('\r')) text.remove_suffix(1);
    at_ = end + 1;
    if (text == "end") break;
    const std::string_view keyword = text.substr(0, text.find(' '));
    take_header_line(std::string(keyword), std::string(text.substr(std::min(text.size(), keyword.size() + 1))), line);
  }
  if (!is_evt3_) {
    fail("{}: its header of {} lines doesn't say its encoding; allowed is \"% evt 3.0\" or \"% format EVT3\"", name_,
         line);
  }
  if ((width_ == 0) != (height_ == 0)) fail("{}: its header has one of width and height; both are needed", name_);
  source_.size = options.size;
  if (width_ > 0) {
    const cv::Size size(width_, height_);
    if (options.size && *options.size != size) {
      fail("{}: its camera has {} x {} pixels; {} x {} were expected", name_, width_, height_, options.size->width,
           options.size->height);
    }
    source_.size = size;
  }
  if (source_.size) check_ = EventCheck(name_, *source_.size);
}

void Evt3EventReader::refuse_word(unsigned word) const {
  fail("{}: the word 0x{:04x} at byte {} is of type 0x{:x}, which EVT 3.0 doesn't have: the file is damaged", name_,
       word, at_ - 2, word >> 12);
}

void Evt3EventReader::read(std::vector<Event>& events) {
  events.resize(kEventPortion + kVectorLength);
  Event* to = events.data();
  const Event* const full = to + kEventPortion;
  const char* const bytes = file_.bytes.get();
  State now = state_;
  std::size_t at = at_;
  while (at < file_.size && to < full) {
    const unsigned word = static_cast<unsigned char>(bytes[at]) | static_cast<unsigned char>(bytes[at + 1]) << 8;
    at += 2;
    switch (word >> 12) {
      case kAddrX:
        if (now.has_time && now.has_row) {
          *to++ = {now.t_us, static_cast<std::uint16_t>(word & kPlace), now.y, (word & kOnBit) != 0};
        } else {
          ++source_.unplaced;
        }
        break;
      case kTimeLow:
        // The time is that of this word with the last TIME_HIGH before it; events keep it until the next such word.
        if (now.high >= 0) {
          now.t_us = now.wraps_us + (std::int64_t{now.high} << kTimeBits) + (word & 0xFFF);
          now.has_time = true;
        }
        break;
      case kAddrY:
        now.y = static_cast<std::uint16_t>(word & kPlace);
        now.has_row = true;
        break;
      case kVectBaseX:
        now.base_x = word & kPlace;
        now.base_on = (word & kOnBit) != 0;
        break;
      case kVect12:
      case kVect8: {
        const bool twelve = word >> 12 == kVect12;
        unsigned valid = word & (twelve ? 0xFFFu : 0xFFu);
        if (!now.has_time || !now.has_row) {
          source_.unplaced += std::popcount(valid);
          valid = 0;
        }
        for (; valid != 0; valid &= valid - 1) {
          const auto x = static_cast<std::uint16_t>(now.base_x + static_cast<unsigned>(std::countr_zero(valid)));
          *to++ = {now.t_us, x, now.y, now.base_on};
        }
        now.base_x = std::min(now.base_x + (twelve ? 12 : 8), kFarColumn);
        break;
      }
      case kTimeHigh: {
        // It only grows, but for the wrap. A smaller step down is an error that shows in the next event's time.
        const auto high = static_cast<int>(word & 0xFFF);
        if (high < now.high - kHighs / 2) now.wraps_us += kWrapUs;
        now.high = high;
        break;
      }
      case kExtTrigger:
        ++source_.triggers;
        break;
      case kContinued4:
      case kContinued12:
      case kOthers:
        ++source_.others;
        break;
      default:
        at_ = at;
        refuse_word(word);
    }
  }
  at_ = at;
  state_ = now;
  events.resize(static_cast<std::size_t>(to - events.data()));
  if (offset_us_ != 0) {
    for (Event& event : events) event.t_us += offset_us_;
  }
  check_.pass(events);
  source_.events += static_cast<std::int64_t>(events.size());
}

Evt3Encoder::Evt3Encoder(const std::string& name, cv::Size size, std::string program, Sink sink)
    : size_(size), program_(std::move(program)), sink_(std::move(sink)) {
  if (size.width > kLargestSide || size.height > kLargestSide) {
    fail("{}: the camera has {} x {} pixels; EVT 3.0 holds 1 to {}", name, size.width, size.height, kLargestSide);
  }
}

void Evt3Encoder::start(std::int64_t first_us) {
  started_ = true;
  offset_us_ = wraps_down(first_us);
  buffer_ =
      fmt::format("% evt 3.0\n% format EVT3;height={1};width={0}\n% geometry {0}x{1}\n", size_.width, size_.height);
  buffer_ += fmt::format("% integrator_name Touchstone\n% plugin_name {}\n", program_);
  if (offset_us_ != 0) buffer_ += fmt::format("% {} {}\n", kOffsetKeyword, offset_us_);
  buffer_ += "% end\n";
}

void Evt3Encoder::put(unsigned type, unsigned payload) {
  const unsigned word = type << 12 | payload;
  buffer_ += static_cast<char>(word & 0xFF);
  buffer_ += static_cast<char>(word >> 8);
}

void Evt3Encoder::write_time(std::int64_t t_us) {
  if (t_us == t_us_) return;
  const std::int64_t high = t_us >> kTimeBits;
  // Over long silences so often that no wrap is missed.
  while (high_ >= 0 && high - high_ >= kHighs / 2) {
    high_ += kHighs / 2 - 1;
    put(kTimeHigh, static_cast<unsigned>(high_ % kHighs));
    if (buffer_.size() >= kFlushBytes) flush();
  }
  if (high != high_) put(kTimeHigh, static_cast<unsigned>(high % kHighs));
  high_ = high;
  put(kTimeLow, static_cast<unsigned>(t_us & 0xFFF));
  t_us_ = t_us;
}

/// Events of one time, row and polarity, of growing columns no more than a vector apart.
void Evt3Encoder::write_run(std::span<const Event> run) {
  const unsigned polarity = run.front().on ? kOnBit : 0;
  const unsigned first = run.front().x;
  const unsigned span = run.back().x - first + 1u;
  const std::size_t vectors = (span + kVectorLength - 1) / kVectorLength;
  if (run.size() <= vectors + 1) {
    for (const Event& event : run) put(kAddrX, polarity | event.x);
    return;
  }
  put(kVectBaseX, polarity | first);
  std::size_t next = 0;
  for (std::size_t i = 0; i < vectors; ++i) {
    const unsigned base = first + static_cast<unsigned>(i) * kVectorLength;
    unsigned valid = 0;
    for (; next < run.size() && run[next].x < base + kVectorLength; ++next) valid |= 1u << (run[next].x - base);
    const bool eight = i + 1 == vectors && valid < 1u << 8;
    put(eight ? kVect8 : kVect12, valid);
  }
}

void Evt3Encoder::pass_time(std::int64_t t_us) {
  if (!started_) start(t_us);
  write_time(t_us - offset_us_);
}

void Evt3Encoder::append(std::span<const Event> events) {
  for (std::size_t i = 0; i < events.size();) {
    const Event& first = events[i];
    if (!started_) start(first.t_us);
    write_time(first.t_us - offset_us_);
    if (first.y != y_) put(kAddrY, first.y);
    y_ = first.y;
    std::size_t end = i + 1;
    while (end < events.size() && events[end].t_us == first.t_us && events[end].y == first.y &&
           events[end].on == first.on && events[end].x > events[end - 1].x &&
           events[end].x - events[end - 1].x <= static_cast<int>(kVectorLength)) {
      ++end;
    }
    write_run(events.subspan(i, end - i));
    i = end;
    if (buffer_.size() >= kFlushBytes) flush();
  }
}

void Evt3Encoder::flush() {
  if (!buffer_.empty()) sink_(buffer_);
  buffer_.clear();
}

Evt3EventWriter::Evt3EventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program)
    : name_(file.string()),
      out_(file, std::ios::binary),
      encoder_(name_, size, program, [this](std::string_view bytes) {
        out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      }) {
  if (!out_) fail("{}: can't be written", name_);
}

void Evt3EventWriter::close() {
  if (!encoder_.started()) encoder_.start(0);
  encoder_.flush();
  out_.close();
  if (!out_) fail("{}: can't be written", name_);
}

}  // namespace touchstone::sensors
