#include "sensors/events/event_file.h"

#include <array>
#include <string_view>
#include <variant>

#include "core/error.h"
#include "core/input_file.h"
#include "sensors/events/event_check.h"
#include "sensors/events/event_file_aedat4.h"
#include "sensors/events/event_file_dsec.h"
#include "sensors/events/event_file_evt3.h"
#include "sensors/events/event_file_text.h"

namespace touchstone::sensors {
namespace {

using AnyReader = std::variant<TextEventReader, DsecEventReader, Evt3EventReader, Aedat4EventReader>;
using AnyWriter = std::variant<TextEventWriter, DsecEventWriter, Evt3EventWriter, Aedat4EventWriter>;

/// What the file's first bytes say that it is, and where they don't, its name.
EventFormat format_of(const std::filesystem::path& file) {
  std::array<char, 9> first{};
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) fail("{}: there is no such file", file.string());
  InputFile in(file);
  const std::string_view bytes(first.data(), in.read(first.data(), first.size()));
  if (bytes.empty()) fail("{}: is empty", file.string());
  if (bytes.starts_with("\x89HDF\r\n\x1a\n")) return EventFormat::dsec;
  if (bytes.starts_with("#!AER-DAT")) return EventFormat::aedat4;
  if (bytes.starts_with("% ")) return EventFormat::evt3;
  return event_format_of_name(file);
}

AnyReader open(const std::filesystem::path& file, const EventReadOptions& options) {
  if (options.size && (options.size->width < 1 || options.size->height < 1)) {
    fail("{}: a camera of {} x {} pixels was expected; allowed is 1 and more", file.string(), options.size->width,
         options.size->height);
  }
  switch (format_of(file)) {
    case EventFormat::text:
      return AnyReader(std::in_place_type<TextEventReader>, file, options);
    case EventFormat::dsec:
      return AnyReader(std::in_place_type<DsecEventReader>, file, options);
    case EventFormat::evt3:
      return AnyReader(std::in_place_type<Evt3EventReader>, file, options);
    case EventFormat::aedat4:
      break;
  }
  return AnyReader(std::in_place_type<Aedat4EventReader>, file, options);
}

AnyWriter create(const std::filesystem::path& file, cv::Size size, const std::string& program) {
  if (size.width < 1 || size.height < 1) {
    fail("{}: the camera has {} x {} pixels; allowed is 1 and more", file.string(), size.width, size.height);
  }
  switch (event_format_of_name(file)) {
    case EventFormat::text:
      return AnyWriter(std::in_place_type<TextEventWriter>, file, size, program);
    case EventFormat::dsec:
      return AnyWriter(std::in_place_type<DsecEventWriter>, file, size, program);
    case EventFormat::evt3:
      return AnyWriter(std::in_place_type<Evt3EventWriter>, file, size, program);
    case EventFormat::aedat4:
      break;
  }
  return AnyWriter(std::in_place_type<Aedat4EventWriter>, file, size, program);
}

}  // namespace

EventFormat event_format_of_name(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  if (ending == ".txt" || ending == ".csv") return EventFormat::text;
  if (ending == ".h5" || ending == ".hdf5") return EventFormat::dsec;
  if (ending == ".raw") return EventFormat::evt3;
  if (ending == ".aedat4") return EventFormat::aedat4;
  fail("{}: a file of events ends in .h5 or .hdf5 (DSEC), .raw (EVT 3.0), .aedat4, .txt or .csv", file.string());
}

struct EventReader::Parts {
  AnyReader reader;
  std::vector<Event> events;
};

EventReader::EventReader(const std::filesystem::path& file, const EventReadOptions& options)
    : parts_(new Parts{open(file, options), {}}) {}

EventReader::~EventReader() = default;

std::span<const Event> EventReader::next() {
  std::visit([&](auto& reader) { reader.read(parts_->events); }, parts_->reader);
  return parts_->events;
}

const EventSource& EventReader::source() const {
  return std::visit([](const auto& reader) -> const EventSource& { return reader.source(); }, parts_->reader);
}

EventRecording read_events(const std::filesystem::path& file, const EventReadOptions& options) {
  EventReader reader(file, options);
  EventRecording recording;
  for (auto portion = reader.next(); !portion.empty(); portion = reader.next()) {
    recording.events.insert(recording.events.end(), portion.begin(), portion.end());
  }
  recording.source = reader.source();
  return recording;
}

struct EventWriter::Parts {
  AnyWriter writer;
  EventCheck check;
  std::vector<Event> waiting;  // portions of one size, so that the file doesn't depend on how events came

  void write(std::span<const Event> events) {
    std::visit([&](auto& to) { to.append(events); }, writer);
  }
};

EventWriter::EventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program)
    : parts_(new Parts{create(file, size, program), EventCheck(file.string(), size), {}}) {}

EventWriter::~EventWriter() = default;

void EventWriter::append(std::span<const Event> events) {
  parts_->check.pass(events);
  std::vector<Event>& waiting = parts_->waiting;
  while (!events.empty()) {
    const std::size_t taken = std::min(events.size(), kEventPortion - waiting.size());
    waiting.insert(waiting.end(), events.begin(), events.begin() + static_cast<std::ptrdiff_t>(taken));
    events = events.subspan(taken);
    if (waiting.size() < kEventPortion) return;
    parts_->write(waiting);
    waiting.clear();
  }
}

void EventWriter::close() {
  if (!parts_->waiting.empty()) parts_->write(parts_->waiting);
  std::visit([](auto& to) { to.close(); }, parts_->writer);
}

}  // namespace touchstone::sensors
