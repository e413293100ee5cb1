#include "sensors/events/event_file_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "core/error.h"
#include "core/text_file.h"

namespace touchstone::sensors {
namespace {

constexpr int kVersion = 2;
constexpr int kLargestSide = 65536;
// Of a camera that nothing is said of, where no line names the columns either. The largest event cameras have some 3000
// pixels a side; more is the time of a file of x, y, t, p.
constexpr int kLargestUnnamedSide = 8192;
constexpr std::size_t kFlushBytes = 1 << 20;
constexpr double kExactUs = 9007199254740992.0;  // 2^53: a double tells every whole number up to here

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

void skip_spaces(const char*& at, const char* end) {
  while (at < end && is_space(*at)) ++at;
}

/// Passes what sets two fields apart: blanks with at most one comma.
void skip_separator(const char*& at, const char* end) {
  skip_spaces(at, end);
  if (at < end && *at == ',') ++at;
  skip_spaces(at, end);
}

std::string_view field_at(const char* at, const char* end) {
  const char* to = at;
  while (to < end && !is_space(*to) && *to != ',') ++to;
  return {at, static_cast<std::size_t>(to - at)};
}

bool ends_field(const char* at, const char* end) {
  return at == end || is_space(*at) || *at == ',';
}

/// Reads decimal digits; false if there are none or too many.
bool read_digits(const char*& at, const char* end, std::int64_t& value) {
  constexpr int kMostDigits = 18;
  const char* const from = at;
  std::int64_t sum = 0;
  for (; at < end && *at >= '0' && *at <= '9'; ++at) {
    if (at - from < kMostDigits) sum = 10 * sum + (*at - '0');
  }
  value = sum;
  return at > from && at - from <= kMostDigits;
}

std::vector<std::string_view> fields_of(const char* from, const char* end) {
  std::vector<std::string_view> fields;
  skip_spaces(from, end);
  while (from < end) {
    const std::string_view field = field_at(from, end);
    fields.push_back(field);
    from += field.size();
    skip_separator(from, end);
  }
  return fields;
}

}  // namespace

TextEventReader::TextEventReader(const std::filesystem::path& file, const EventReadOptions& options)
    : name_(file.string()), file_(map_file(file)), options_(options), check_(name_, {kLargestSide, kLargestSide}) {
  source_.format = EventFormat::text;
  if (options.size) source_.size = options.size;
  at_ = byte_order_mark({file_.bytes.get(), file_.size});
}

void TextEventReader::refuse(const std::string& what) const {
  fail_at({name_, line_}, "{}", what);
}

bool TextEventReader::take_names(const char* from, const char* end) {
  const std::vector<std::string_view> names = fields_of(from, end);
  if (names.size() != 4) return false;
  std::array<Column, 4> columns{};
  std::array<int, 4> seen{};
  TimeUnit unit = TimeUnit::unknown;
  for (std::size_t i = 0; i < 4; ++i) {
    if (names[i] == "t_us" || names[i] == "t_s") {
      columns[i] = Column::time;
      unit = names[i] == "t_us" ? TimeUnit::microsecond : TimeUnit::second;
    } else if (names[i] == "x") {
      columns[i] = Column::x;
    } else if (names[i] == "y") {
      columns[i] = Column::y;
    } else if (names[i] == "p") {
      columns[i] = Column::polarity;
    } else {
      return false;
    }
    ++seen[static_cast<std::size_t>(columns[i])];
  }
  if (seen != std::array<int, 4>{1, 1, 1, 1}) return false;
  columns_ = columns;
  named_ = true;
  unit_ = unit;
  return true;
}

void TextEventReader::read_comment(const char* from, const char* end) {
  if (started_ || take_names(from, end)) return;
  const std::vector<std::string_view> words = fields_of(from, end);
  if (words.size() != 2) return;
  int value = 0;
  const auto [to, error] = std::from_chars(words[1].data(), words[1].data() + words[1].size(), value);
  if (error != std::errc() || to != words[1].data() + words[1].size()) return;
  if (words[0] == "touchstone-events" && value != kVersion) {
    refuse(fmt::format("is of version {}; this program reads {}", value, kVersion));
  }
  if (words[0] == "width") width_ = value;
  if (words[0] == "height") height_ = value;
}

void TextEventReader::read_size(const char* from, const char* end) {
  const std::vector<std::string_view> words = fields_of(from, end);
  std::array<int, 2> sides{};
  for (std::size_t i = 0; i < 2; ++i) {
    const char* const to = words[i].data() + words[i].size();
    if (const auto [at, error] = std::from_chars(words[i].data(), to, sides[i]); error != std::errc() || at != to) {
      refuse(fmt::format("'{}' isn't a number; two fields are allowed only for width and height", words[i]));
    }
  }
  width_ = sides[0];
  height_ = sides[1];
}

void TextEventReader::start_events() {
  started_ = true;
  if (width_.has_value() != height_.has_value())
    refuse("the comments above have one of width and height; both are needed");
  if (!width_) {
    if (options_.size) check_ = EventCheck(name_, *options_.size);
    return;
  }
  if (*width_ < 1 || *width_ > kLargestSide || *height_ < 1 || *height_ > kLargestSide) {
    refuse(fmt::format("the camera has {} x {} pixels; allowed is 1 to {}", *width_, *height_, kLargestSide));
  }
  const cv::Size size(*width_, *height_);
  if (options_.size && *options_.size != size) {
    refuse(fmt::format("the camera has {} x {} pixels; {} x {} were expected", size.width, size.height,
                       options_.size->width, options_.size->height));
  }
  source_.size = size;
  check_ = EventCheck(name_, size);
}

std::int64_t TextEventReader::time_of(const char*& at, const char* end) {
  const char* const from = at;
  std::int64_t whole = 0;
  const bool negative = at < end && *at == '-';
  if (negative) ++at;
  const bool read = read_digits(at, end, whole);
  const bool ended = ends_field(at, end);
  if (unit_ == TimeUnit::unknown) unit_ = read && ended ? TimeUnit::microsecond : TimeUnit::second;
  if (unit_ == TimeUnit::microsecond) {
    if (!read || !ended) refuse(fmt::format("'{}' isn't a whole number of us", field_at(from, end)));
    return negative ? -whole : whole;
  }
  double seconds = 0.0;
  const auto [to, error] = std::from_chars(from, end, seconds);
  const double us = 1e6 * seconds;
  if (error != std::errc() || !ends_field(to, end) || !(std::abs(us) < kExactUs)) {
    refuse(fmt::format("'{}' isn't a time in seconds (of less than {:.0f} s)", field_at(from, end), 1e-6 * kExactUs));
  }
  at = to;
  return std::llround(us);
}

/// Reads on to the end of the next event's line; false at the end of the file.
bool TextEventReader::read_line(Event& event) {
  const char* const bytes = file_.bytes.get();
  while (at_ < file_.size) {
    const char* at = bytes + at_;
    const auto* end = static_cast<const char*>(std::memchr(at, '\n', file_.size - at_));
    if (end == nullptr) end = bytes + file_.size;
    at_ = std::min(file_.size, static_cast<std::size_t>(end - bytes) + 1);
    ++line_;
    skip_spaces(at, end);
    if (at == end) continue;
    if (*at == '#') {
      read_comment(at + 1, end);
      continue;
    }
    if (!started_) {
      if ((*at >= 'a' && *at <= 'z') || (*at >= 'A' && *at <= 'Z')) {
        if (take_names(at, end)) continue;
        refuse(fmt::format("'{}' isn't a line of names; allowed are t_us or t_s, x, y and p, each once",
                           std::string_view(at, static_cast<std::size_t>(end - at)).substr(0, 40)));
      }
      if (!width_ && fields_of(at, end).size() == 2) {
        read_size(at, end);
        continue;
      }
      start_events();
    }
    for (std::size_t i = 0; i < 4; ++i) {
      if (at == end) refuse(fmt::format("has {} fields; allowed is four", i));
      std::int64_t value = 0;
      const char* const from = at;
      switch (columns_[i]) {
        case Column::time:
          event.t_us = time_of(at, end);
          break;
        case Column::x:
        case Column::y:
          if (!read_digits(at, end, value) || !ends_field(at, end) || value >= kLargestSide) {
            refuse(
                fmt::format("'{}' isn't a column or row; allowed is 0 to {}", field_at(from, end), kLargestSide - 1));
          }
          if (!named_ && !source_.size && value >= kLargestUnnamedSide) {
            refuse(
                fmt::format("'{}' would be a column or row of a camera: without a line of names fields are t x y p. "
                            "Write the names of this file's before its events, as in '# x y t_us p'",
                            value));
          }
          (columns_[i] == Column::x ? event.x : event.y) = static_cast<std::uint16_t>(value);
          break;
        case Column::polarity: {
          const std::string_view field = field_at(at, end);
          const bool on = field == "1" || field == "+1" || field == "True" || field == "true";
          if (!on && field != "0" && field != "-1" && field != "False" && field != "false") {
            refuse(fmt::format("'{}' isn't a polarity; allowed is 1 or true for ON, 0, -1 or false for OFF", field));
          }
          event.on = on;
          at += field.size();
        }
      }
      skip_separator(at, end);
    }
    if (at != end) refuse(fmt::format("'{}' is a fifth field; allowed is four", field_at(at, end)));
    return true;
  }
  if (!started_) start_events();  // a file without events may still say how large its camera is
  return false;
}

void TextEventReader::read(std::vector<Event>& events) {
  events.clear();
  Event event;
  while (events.size() < kEventPortion && read_line(event)) {
    if (!check_.takes(event)) check_.refuse(event, fmt::format("line {}", line_));
    check_.take(event);
    events.push_back(event);
  }
  source_.events += static_cast<std::int64_t>(events.size());
}

TextEventWriter::TextEventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program)
    : name_(file.string()), out_(file, std::ios::binary), separator_(file.extension() == ".csv" ? ',' : ' ') {
  if (!out_) fail("{}: can't be written", name_);
  buffer_ = fmt::format("# touchstone-events {}\n# program {}\n# width {}\n# height {}\n", kVersion, program,
                        size.width, size.height);
  buffer_ += separator_ == ',' ? "t_us,x,y,p\n" : "# t_us x y p\n";
}

void TextEventWriter::append(std::span<const Event> events) {
  std::array<char, 64> line{};
  for (const Event& event : events) {
    char* at = std::to_chars(line.data(), line.data() + line.size(), event.t_us).ptr;
    *at++ = separator_;
    at = std::to_chars(at, line.data() + line.size(), event.x).ptr;
    *at++ = separator_;
    at = std::to_chars(at, line.data() + line.size(), event.y).ptr;
    *at++ = separator_;
    *at++ = event.on ? '1' : '0';
    *at++ = '\n';
    buffer_.append(line.data(), at);
    if (buffer_.size() >= kFlushBytes) flush();
  }
}

void TextEventWriter::flush() {
  out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  buffer_.clear();
}

void TextEventWriter::close() {
  flush();
  out_.close();
  if (!out_) fail("{}: can't be written", name_);
}

}  // namespace touchstone::sensors
