#pragma once
// Events as iniVation AEDAT 4.0 ([AEDAT40]; FlatBuffers within packets).

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/frame.h"
#include "core/mapped_file.h"
#include "sensors/events/event_check.h"
#include "sensors/events/event_source.h"
#include "sensors/events/packet_compression.h"

namespace touchstone::sensors {

/// Reads the packets of one stream of events, plain, LZ4 or Zstandard; those of other streams are left out and counted.
/// Times are us, as they stand (a real camera's: since 1970). The table of packets at the file's end isn't needed.
class Aedat4EventReader {
 public:
  /// Reads the header and chooses the stream of events. @throws Error as EventReader
  Aedat4EventReader(const std::filesystem::path& file, const EventReadOptions& options);

  /// Puts the next packet that has events into `events`, nothing at the end.
  void read(std::vector<Event>& events);
  const EventSource& source() const { return source_; }

 private:
  /// What the header says of a stream.
  struct Stream {
    std::string type;  ///< EVTS, FRME, IMUS, TRIG
    int width = 0, height = 0;
  };

  void read_header();
  void read_streams(std::string_view xml);
  void choose_stream(const EventReadOptions& options);
  void unpack_events(std::span<const char> packet, std::vector<Event>& events);

  std::string name_;
  MappedFile file_;
  EventSource source_;
  EventCheck check_;
  PacketCompression compression_ = PacketCompression::none;
  std::map<int, Stream> streams_;
  int stream_ = -1;
  std::size_t at_ = 0;
  std::size_t end_ = 0;  // of the packets
  std::vector<char> content_;
};

/// Writes one stream, 0, of packets of 8192 events as LZ4 frames with checksums, and the table of packets.
class Aedat4EventWriter {
 public:
  /// @throws Error if the camera has more than 32768 columns or rows
  Aedat4EventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program);
  /// @pre within the picture, in the order of time
  void append(std::span<const Event> events);
  /// Writes the last packet and the table. @throws Error if the file can't be written
  void close();

 private:
  /// Of one packet, for the table.
  struct Packet {
    std::int64_t at = 0;  // of its content
    std::int32_t bytes = 0;
    std::int64_t events = 0, first_us = 0, last_us = 0;
  };

  std::vector<char> header(std::int64_t table_at) const;
  void write_packet(std::span<const Event> events);
  void write(std::span<const char> bytes);

  std::string name_;
  std::ofstream out_;
  std::string info_;
  std::int64_t at_ = 0;
  std::vector<Packet> packets_;
};

}  // namespace touchstone::sensors
