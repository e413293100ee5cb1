#pragma once
// Events as Prophesee RAW files of EVT 3.0 words [EVT30].

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/frame.h"
#include "core/mapped_file.h"
#include "sensors/events/event_check.h"
#include "sensors/events/event_source.h"

namespace touchstone::sensors {

/// Reads little-endian files whose header says "evt 3.0" or "format EVT3". Times are the camera's: they start where its
/// clock was, in 0 to 16.8 s, and go on over the wraps of its 24 bits (files of ours say what to add, in the header).
/// External triggers, words of the maker's own and what comes before the first full time and row are left out and
/// counted. A file that ends on a whole word looks whole: the format has no length.
class Evt3EventReader {
 public:
  /// Reads the header. @throws Error as EventReader
  Evt3EventReader(const std::filesystem::path& file, const EventReadOptions& options);

  /// Puts the next portion into `events`, nothing at the end.
  void read(std::vector<Event>& events);
  const EventSource& source() const { return source_; }

 private:
  /// What the words so far have set.
  struct State {
    std::int64_t t_us = 0;
    std::int64_t wraps_us = 0;
    int high = -1;  // none yet
    unsigned base_x = 0;
    std::uint16_t y = 0;
    bool base_on = false;
    bool has_time = false;
    bool has_row = false;
  };

  void read_header(const EventReadOptions& options);
  void take_header_line(const std::string& keyword, const std::string& value, int line);
  [[noreturn]] void refuse_word(unsigned word) const;

  std::string name_;
  MappedFile file_;
  EventSource source_;
  EventCheck check_;
  std::size_t at_ = 0;
  bool is_evt3_ = false;
  std::int64_t offset_us_ = 0;
  int width_ = 0, height_ = 0;
  State state_;
};

/// Turns events into EVT 3.0, with vectors where they are shorter, for a file or a socket. Times that 24 bits don't
/// hold are those of wraps, or, for what lies before the first event, in the header line "touchstone_t_offset_us".
class Evt3Encoder {
 public:
  /// Takes the next bytes, a megabyte at most.
  using Sink = std::function<void(std::string_view bytes)>;

  /// @param name whose camera it is, for errors @throws Error if the camera has more than 2048 columns or rows
  Evt3Encoder(const std::string& name, cv::Size size, std::string program, Sink sink);

  /// The header, for a stream whose times are at or after `first_us`. append() calls it if nobody did.
  void start(std::int64_t first_us);
  bool started() const { return started_; }
  /// Says what time it is where nothing happens: in a stream, at least every 8 seconds.
  void pass_time(std::int64_t t_us);
  /// @pre within the picture, in the order of time
  void append(std::span<const Event> events);
  /// Hands over what is held back.
  void flush();

 private:
  void write_time(std::int64_t t_us);
  void write_run(std::span<const Event> run);
  void put(unsigned type, unsigned payload);

  cv::Size size_;
  std::string program_;
  Sink sink_;
  std::string buffer_;
  bool started_ = false;
  std::int64_t offset_us_ = 0;
  std::int64_t high_ = -1;  // of the last word, not wrapped
  std::int64_t t_us_ = -1;
  int y_ = -1;
};

/// Writes a file of it.
class Evt3EventWriter {
 public:
  /// @throws Error as Evt3Encoder
  Evt3EventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program);
  Evt3EventWriter(const Evt3EventWriter&) = delete;
  Evt3EventWriter& operator=(const Evt3EventWriter&) = delete;
  /// @pre within the picture, in the order of time
  void append(std::span<const Event> events) { encoder_.append(events); }
  /// Writes what is left. @throws Error if the file can't be written
  void close();

 private:
  std::string name_;
  std::ofstream out_;
  Evt3Encoder encoder_;
};

}  // namespace touchstone::sensors
