#include "sensors/events/event_file_aedat4.h"

#include <flatbuffers/flatbuffers.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <pugixml.hpp>
#include <sstream>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr std::string_view kVersionLine = "#!AER-DAT4.0\r\n";
constexpr std::string_view kAnyVersion = "#!AER-DAT";
constexpr const char* kEvents = "EVTS";
constexpr const char* kTriggers = "TRIG";
constexpr int kLargestSide = 32768;                // columns and rows are int16
constexpr std::size_t kMostPacketBytes = 1 << 28;  // unpacked: 16 million events
constexpr std::size_t kPacketEvents = 8192;
constexpr std::size_t kPacketHeader = 8;
constexpr std::size_t kSizePrefix = 4;

// The tables, as the FlatBuffers schemas of DV have them: field i of a table has the number 4 + 2 i in its vtable.
constexpr flatbuffers::voffset_t kCompressionField = 4;    // IOHeader ("IOHE"): enum of 32 bits
constexpr flatbuffers::voffset_t kTablePositionField = 6;  // int64, -1 if there's none
constexpr flatbuffers::voffset_t kInfoField = 8;           // string, XML
constexpr flatbuffers::voffset_t kElementsField = 4;       // EventPacket ("EVTS"): vector of events
constexpr flatbuffers::voffset_t kDefinitionsField = 4;    // FileDataTable ("FTAB"): vector of tables
constexpr flatbuffers::voffset_t kByteOffsetField = 4;     // FileDataDefinition: int64
constexpr flatbuffers::voffset_t kPacketInfoField = 6;     // struct PacketHeader
constexpr flatbuffers::voffset_t kElementCountField = 8;   // int64
constexpr flatbuffers::voffset_t kFirstTimeField = 10;     // int64
constexpr flatbuffers::voffset_t kLastTimeField = 12;      // int64

/// struct Event: 16 bytes.
FLATBUFFERS_MANUALLY_ALIGNED_STRUCT(8) PackedEvent {
  std::int64_t t_us;
  std::int16_t x, y;
  std::uint8_t on;
  std::uint8_t nothing[3];
};
FLATBUFFERS_STRUCT_END(PackedEvent, 16);

/// struct PacketHeader: 8 bytes, also ahead of each packet.
FLATBUFFERS_MANUALLY_ALIGNED_STRUCT(4) PacketHeader {
  std::int32_t stream;
  std::int32_t bytes;
};
FLATBUFFERS_STRUCT_END(PacketHeader, 8);

struct IoHeader : private flatbuffers::Table {
  std::int32_t compression() const { return GetField<std::int32_t>(kCompressionField, 0); }
  std::int64_t table_position() const { return GetField<std::int64_t>(kTablePositionField, -1); }
  const flatbuffers::String* info() const { return GetPointer<const flatbuffers::String*>(kInfoField); }
  bool Verify(flatbuffers::Verifier& verifier) const {
    return VerifyTableStart(verifier) && VerifyField<std::int32_t>(verifier, kCompressionField, 4) &&
           VerifyField<std::int64_t>(verifier, kTablePositionField, 8) && VerifyOffset(verifier, kInfoField) &&
           verifier.VerifyString(info()) && verifier.EndTable();
  }
};

struct EventPacket : private flatbuffers::Table {
  const flatbuffers::Vector<const PackedEvent*>* elements() const {
    return GetPointer<const flatbuffers::Vector<const PackedEvent*>*>(kElementsField);
  }
  bool Verify(flatbuffers::Verifier& verifier) const {
    return VerifyTableStart(verifier) && VerifyOffset(verifier, kElementsField) && verifier.VerifyVector(elements()) &&
           verifier.EndTable();
  }
};

/// The root table of a buffer behind its size prefix, once every offset in it is known to stay within; else nothing.
/// Alignment isn't asked for: not every writer keeps it.
template <typename Table>
const Table* verified(std::span<const char> buffer) {
  constexpr flatbuffers::uoffset_t kDepth = 8;
  constexpr flatbuffers::uoffset_t kTables = 1000;
  if (buffer.size() < sizeof(flatbuffers::uoffset_t) || buffer.size() > FLATBUFFERS_MAX_BUFFER_SIZE) return nullptr;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(buffer.data());
  flatbuffers::Verifier verifier(bytes, buffer.size(), kDepth, kTables, false);
  return verifier.VerifyBuffer<Table>(nullptr) ? flatbuffers::GetRoot<Table>(bytes) : nullptr;
}

std::uint32_t number_at(const char* bytes) {
  return flatbuffers::ReadScalar<std::uint32_t>(bytes);
}

/// The text of <attr key="..."> of a node of the XML.
std::string_view attribute_of(const pugi::xml_node& node, const char* key) {
  return node.find_child_by_attribute("attr", "key", key).child_value();
}

int whole_number(std::string_view text, int otherwise) {
  int value = 0;
  const auto [at, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && at == text.data() + text.size() ? value : otherwise;
}

std::span<const char> bytes_of(const flatbuffers::FlatBufferBuilder& builder) {
  return {reinterpret_cast<const char*>(builder.GetBufferPointer()), builder.GetSize()};
}

void add_attribute(pugi::xml_node& node, const char* key, const char* type, const std::string& value) {
  pugi::xml_node made = node.append_child("attr");
  made.append_attribute("key") = key;
  made.append_attribute("type") = type;
  made.text() = value.c_str();
}

pugi::xml_node add_node(pugi::xml_node& node, const char* name, const char* path) {
  pugi::xml_node made = node.append_child("node");
  made.append_attribute("name") = name;
  made.append_attribute("path") = path;
  return made;
}

}  // namespace

Aedat4EventReader::Aedat4EventReader(const std::filesystem::path& file, const EventReadOptions& options)
    : name_(file.string()), file_(map_file(file)), check_(name_, {kLargestSide, kLargestSide}) {
  source_.format = EventFormat::aedat4;
  read_header();
  choose_stream(options);
}

void Aedat4EventReader::read_header() {
  const std::string_view bytes(file_.bytes.get(), file_.size);
  if (!bytes.starts_with(kVersionLine)) {
    if (!bytes.starts_with(kAnyVersion)) fail("{}: isn't AEDAT 4.0", name_);
    fail("{}: its first line is '{}'; allowed is '#!AER-DAT4.0'", name_,
         bytes.substr(0, std::min<std::size_t>(20, bytes.find_first_of("\r\n"))));
  }
  at_ = kVersionLine.size() + kSizePrefix;
  const std::size_t header_bytes = bytes.size() < at_ ? 0 : number_at(bytes.data() + kVersionLine.size());
  if (bytes.size() < at_ || header_bytes > bytes.size() - at_) {
    fail("{}: its header of {} bytes at byte {} is broken off after {}", name_, header_bytes, kVersionLine.size(),
         bytes.size() - kVersionLine.size());
  }
  const auto* const header = verified<IoHeader>({bytes.data() + at_, header_bytes});
  if (header == nullptr || header->info() == nullptr) {
    fail("{}: its header at byte {} is damaged: an offset leads out of it", name_, kVersionLine.size());
  }
  at_ += header_bytes;
  if (header->compression() < 0 || header->compression() > static_cast<int>(PacketCompression::zstd_high)) {
    fail("{}: its compression is {}; allowed is 0 to {} (none, LZ4, LZ4 high, Zstandard, Zstandard high)", name_,
         header->compression(), static_cast<int>(PacketCompression::zstd_high));
  }
  compression_ = static_cast<PacketCompression>(header->compression());
  const std::int64_t table_at = header->table_position();
  end_ = table_at < 0 ? file_.size : static_cast<std::size_t>(table_at);
  if (end_ < at_ || end_ > file_.size) {
    fail("{}: its table of packets stands at byte {}; allowed is {} to {}: the file is broken off or damaged", name_,
         table_at, at_, file_.size);
  }
  read_streams(header->info()->string_view());
}

void Aedat4EventReader::read_streams(std::string_view xml) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
  if (!parsed)
    fail("{}: the XML of its header is damaged at character {}: {}", name_, parsed.offset, parsed.description());
  const pugi::xml_node streams = document.find_node(
      [](const pugi::xml_node& node) { return std::string_view(node.attribute("name").value()) == "outInfo"; });
  for (const pugi::xml_node& node : streams.children("node")) {
    const int number = whole_number(node.attribute("name").value(), -1);
    if (number < 0) fail("{}: the stream '{}' of its header isn't a number", name_, node.attribute("name").value());
    const pugi::xml_node info = node.find_child_by_attribute("node", "name", "info");
    streams_[number] = {std::string(attribute_of(node, "typeIdentifier")), whole_number(attribute_of(info, "sizeX"), 0),
                        whole_number(attribute_of(info, "sizeY"), 0)};
  }
}

void Aedat4EventReader::choose_stream(const EventReadOptions& options) {
  std::string known;
  int of_events = 0;
  for (const auto& [number, stream] : streams_) {
    known += fmt::format("{}{} {}", known.empty() ? "" : ", ", number, stream.type);
    if (stream.type != kEvents) continue;
    ++of_events;
    if (!options.stream || *options.stream == number) stream_ = number;
  }
  if (of_events == 0) fail("{}: has no stream of events (EVTS); its streams are: {}", name_, known);
  if (options.stream && stream_ < 0) {
    fail("{}: has no stream {} of events (EVTS); its streams are: {}", name_, *options.stream, known);
  }
  if (of_events > 1 && !options.stream) {
    fail("{}: has {} streams of events (EVTS), and one must be chosen; its streams are: {}", name_, of_events, known);
  }
  const Stream& stream = streams_.at(stream_);
  source_.size = options.size;
  if (stream.width != 0 || stream.height != 0) {
    if (stream.width < 1 || stream.width > kLargestSide || stream.height < 1 || stream.height > kLargestSide) {
      fail("{}: its camera has {} x {} pixels; allowed is 1 to {}", name_, stream.width, stream.height, kLargestSide);
    }
    const cv::Size size(stream.width, stream.height);
    if (options.size && *options.size != size) {
      fail("{}: its camera has {} x {} pixels; {} x {} were expected", name_, size.width, size.height,
           options.size->width, options.size->height);
    }
    source_.size = size;
  }
  if (source_.size) check_ = EventCheck(name_, *source_.size);
}

void Aedat4EventReader::unpack_events(std::span<const char> packet, std::vector<Event>& events) {
  const std::size_t packet_at = at_;
  if (const std::string fault = unpack(compression_, packet, kMostPacketBytes, content_); !fault.empty()) {
    fail("{}: the packet at byte {} {}", name_, packet_at, fault);
  }
  const std::size_t held = content_.size();
  if (held < kSizePrefix || number_at(content_.data()) > held - kSizePrefix) {
    fail("{}: the packet at byte {} says that it has {} bytes, but has {}", name_, packet_at,
         held < kSizePrefix ? 0 : number_at(content_.data()), held < kSizePrefix ? 0 : held - kSizePrefix);
  }
  const auto* const table = verified<EventPacket>({content_.data() + kSizePrefix, number_at(content_.data())});
  if (table == nullptr) {
    fail("{}: the events of the packet at byte {} are damaged: an offset leads out of them", name_, packet_at);
  }
  if (table->elements() == nullptr) return;
  const std::uint8_t* from = table->elements()->Data();
  events.resize(table->elements()->size());
  for (Event& event : events) {
    PackedEvent packed{};
    std::memcpy(&packed, from, sizeof packed);  // may stand at any byte
    from += sizeof packed;
    event = {packed.t_us, static_cast<std::uint16_t>(packed.x), static_cast<std::uint16_t>(packed.y), packed.on != 0};
  }
  check_.pass(events);
}

void Aedat4EventReader::read(std::vector<Event>& events) {
  events.clear();
  while (events.empty() && at_ < end_) {
    const char* const bytes = file_.bytes.get() + at_;
    const std::size_t left = end_ - at_;
    if (left < kPacketHeader) fail("{}: the packet at byte {} is broken off after {} bytes", name_, at_, left);
    const auto number = static_cast<std::int32_t>(number_at(bytes));
    const auto size = static_cast<std::int32_t>(number_at(bytes + 4));
    if (size < 0 || static_cast<std::size_t>(size) > left - kPacketHeader) {
      fail("{}: the packet at byte {} has {} bytes; {} are left: the file is broken off or damaged", name_, at_, size,
           left - kPacketHeader);
    }
    const auto found = streams_.find(number);
    if (found == streams_.end()) {
      fail("{}: the packet at byte {} is of stream {}, which the header doesn't know", name_, at_, number);
    }
    if (number == stream_) {
      unpack_events({bytes + kPacketHeader, static_cast<std::size_t>(size)}, events);
    } else {
      ++(found->second.type == kTriggers ? source_.triggers : source_.others);
    }
    at_ += kPacketHeader + static_cast<std::size_t>(size);
  }
  source_.events += static_cast<std::int64_t>(events.size());
}

Aedat4EventWriter::Aedat4EventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program)
    : name_(file.string()), out_(file, std::ios::binary) {
  if (size.width > kLargestSide || size.height > kLargestSide) {
    fail("{}: the camera has {} x {} pixels; AEDAT 4.0 holds 1 to {}", name_, size.width, size.height, kLargestSide);
  }
  if (!out_) fail("{}: can't be written", name_);
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("dv");
  root.append_attribute("version") = "2.0";
  pugi::xml_node streams = add_node(root, "outInfo", "/mainloop/Recorder/outInfo/");
  pugi::xml_node stream = add_node(streams, "0", "/mainloop/Recorder/outInfo/0/");
  add_attribute(stream, "compression", "string", "LZ4");
  add_attribute(stream, "originalModuleName", "string", program);
  add_attribute(stream, "originalOutputName", "string", "events");
  add_attribute(stream, "typeDescription", "string", "Events of one camera.");
  add_attribute(stream, "typeIdentifier", "string", kEvents);
  pugi::xml_node info = add_node(stream, "info", "/mainloop/Recorder/outInfo/0/info/");
  add_attribute(info, "sizeX", "int", std::to_string(size.width));
  add_attribute(info, "sizeY", "int", std::to_string(size.height));
  add_attribute(info, "source", "string", program);
  std::ostringstream text;
  document.save(text, "    ", pugi::format_indent | pugi::format_no_declaration);
  info_ = text.str();
  write(kVersionLine);
  write(header(-1));
}

std::vector<char> Aedat4EventWriter::header(std::int64_t table_at) const {
  flatbuffers::FlatBufferBuilder builder;
  builder.ForceDefaults(true);  // -1 takes the place of the later position
  const auto info = builder.CreateString(info_);
  const flatbuffers::uoffset_t start = builder.StartTable();
  builder.AddElement<std::int64_t>(kTablePositionField, table_at, -1);
  builder.AddOffset(kInfoField, info);
  builder.AddElement<std::int32_t>(kCompressionField, static_cast<int>(PacketCompression::lz4), 0);
  builder.FinishSizePrefixed(flatbuffers::Offset<IoHeader>(builder.EndTable(start)), "IOHE");
  const std::span<const char> bytes = bytes_of(builder);
  return {bytes.begin(), bytes.end()};
}

void Aedat4EventWriter::write(std::span<const char> bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  at_ += static_cast<std::int64_t>(bytes.size());
}

void Aedat4EventWriter::write_packet(std::span<const Event> events) {
  std::vector<PackedEvent> packed(events.size());
  std::transform(events.begin(), events.end(), packed.begin(), [](const Event& event) {
    return PackedEvent{event.t_us,
                       static_cast<std::int16_t>(event.x),
                       static_cast<std::int16_t>(event.y),
                       static_cast<std::uint8_t>(event.on ? 1 : 0),
                       {}};
  });
  flatbuffers::FlatBufferBuilder builder(packed.size() * sizeof(PackedEvent) + 64);
  const auto elements = builder.CreateVectorOfStructs(packed.data(), packed.size());
  const flatbuffers::uoffset_t start = builder.StartTable();
  builder.AddOffset(kElementsField, elements);
  builder.FinishSizePrefixed(flatbuffers::Offset<EventPacket>(builder.EndTable(start)), kEvents);
  const std::vector<char> frame = pack_lz4(bytes_of(builder));
  const PacketHeader packet{0, static_cast<std::int32_t>(frame.size())};
  std::array<char, sizeof packet> ahead{};
  std::memcpy(ahead.data(), &packet, sizeof packet);
  write(ahead);
  packets_.push_back(
      {at_, packet.bytes, static_cast<std::int64_t>(events.size()), events.front().t_us, events.back().t_us});
  write(frame);
}

void Aedat4EventWriter::append(std::span<const Event> events) {
  for (std::size_t i = 0; i < events.size(); i += kPacketEvents) {
    write_packet(events.subspan(i, std::min(kPacketEvents, events.size() - i)));
  }
}

void Aedat4EventWriter::close() {
  flatbuffers::FlatBufferBuilder builder;
  std::vector<flatbuffers::Offset<flatbuffers::Table>> definitions;
  for (const Packet& packet : packets_) {
    const PacketHeader info{0, packet.bytes};
    const flatbuffers::uoffset_t start = builder.StartTable();
    builder.AddElement<std::int64_t>(kByteOffsetField, packet.at, 0);
    builder.AddElement<std::int64_t>(kElementCountField, packet.events, 0);
    builder.AddElement<std::int64_t>(kFirstTimeField, packet.first_us, 0);
    builder.AddElement<std::int64_t>(kLastTimeField, packet.last_us, 0);
    builder.AddStruct(kPacketInfoField, &info);
    definitions.emplace_back(builder.EndTable(start));
  }
  const auto table = builder.CreateVector(definitions);
  const flatbuffers::uoffset_t start = builder.StartTable();
  builder.AddOffset(kDefinitionsField, table);
  builder.FinishSizePrefixed(flatbuffers::Offset<flatbuffers::Table>(builder.EndTable(start)), "FTAB");
  const std::int64_t table_at = at_;
  write(pack_lz4(bytes_of(builder)));  // packed like a packet
  out_.seekp(static_cast<std::streamoff>(kVersionLine.size()));
  write(header(table_at));
  out_.close();
  if (!out_) fail("{}: can't be written", name_);
}

}  // namespace touchstone::sensors
