#include "lab/event_file.h"

#include "core/error.h"
#include "lab/hdf5_file.h"

namespace touchstone::lab {
namespace {

constexpr const char* kFormat = "touchstone-events";
constexpr std::int64_t kFormatVersion = 1;

}  // namespace

struct EventFileWriter::Parts {
  explicit Parts(const std::filesystem::path& path) : file(path) {}
  Hdf5Writer file;
  std::vector<std::int64_t> t_us;
  std::vector<std::uint16_t> x, y;
  std::vector<std::uint8_t> on;
};

EventFileWriter::EventFileWriter(const std::filesystem::path& path, cv::Size size, const std::string& program_version)
    : parts_(std::make_unique<Parts>(path)) {
  Hdf5Writer& file = parts_->file;
  file.set_attribute("format", kFormat);
  file.set_attribute("format_version", kFormatVersion);
  file.set_attribute("program", "touchstone " + program_version);
  file.set_attribute("width", std::int64_t{size.width});
  file.set_attribute("height", std::int64_t{size.height});
  file.add_growing<std::int64_t>({"/events/t_us", "us", "events", "", "Time since the scene's first frame."});
  file.add_growing<std::uint16_t>({"/events/x", "pixels", "events", "", "Column, from 0 at the left."});
  file.add_growing<std::uint16_t>({"/events/y", "pixels", "events", "", "Row, from 0 at the top."});
  file.add_growing<std::uint8_t>({"/events/on", "1", "events", "", "1 where the light grew, 0 where it fell."});
}

EventFileWriter::~EventFileWriter() = default;

void EventFileWriter::append(std::span<const Event> events) {
  Parts& to = *parts_;
  to.t_us.clear();
  to.x.clear();
  to.y.clear();
  to.on.clear();
  for (const Event& event : events) {
    to.t_us.push_back(event.t_us);
    to.x.push_back(event.x);
    to.y.push_back(event.y);
    to.on.push_back(event.on ? 1 : 0);
  }
  to.file.append<std::int64_t>("/events/t_us", to.t_us);
  to.file.append<std::uint16_t>("/events/x", to.x);
  to.file.append<std::uint16_t>("/events/y", to.y);
  to.file.append<std::uint8_t>("/events/on", to.on);
}

void EventFileWriter::close() {
  parts_->file.close();
}

EventFile read_event_file(const std::filesystem::path& path) {
  const Hdf5Reader file(path);
  if (file.text_attribute("/", "format") != kFormat) fail("{}: isn't a file of events", path.string());
  const std::int64_t version = file.integer_attribute("/", "format_version");
  if (version != kFormatVersion) {
    fail("{}: has format version {}; this program reads {}", path.string(), version, kFormatVersion);
  }
  constexpr std::int64_t kMostPixels = 65536;
  const std::int64_t width = file.integer_attribute("/", "width");
  const std::int64_t height = file.integer_attribute("/", "height");
  if (width < 1 || width > kMostPixels || height < 1 || height > kMostPixels) {
    fail("{}: its camera has {} x {} pixels; allowed is 1 to {}", path.string(), width, height, kMostPixels);
  }
  const auto t_us = file.read<std::int64_t>("/events/t_us").values;
  const auto x = file.read<std::uint16_t>("/events/x").values;
  const auto y = file.read<std::uint16_t>("/events/y").values;
  const auto on = file.read<std::uint8_t>("/events/on").values;
  if (x.size() != t_us.size() || y.size() != t_us.size() || on.size() != t_us.size()) {
    fail("{}: its columns aren't of one length", path.string());
  }
  EventFile out;
  out.size = {static_cast<int>(width), static_cast<int>(height)};
  out.events.reserve(t_us.size());
  for (std::size_t i = 0; i < t_us.size(); ++i) {
    if (x[i] >= width || y[i] >= height) {
      fail("{}: event {} is at (column {}, row {}) of {} x {} pixels", path.string(), i, x[i], y[i], width, height);
    }
    if (i > 0 && t_us[i] < t_us[i - 1]) fail("{}: event {} is before the one that comes before it", path.string(), i);
    out.events.push_back({t_us[i], x[i], y[i], on[i] != 0});
  }
  return out;
}

}  // namespace touchstone::lab
