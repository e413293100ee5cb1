// Bytes by hand, from iniVation's description of AEDAT 4.0, its FlatBuffers schemas and FlatBuffers' own description.

#include "sensors/events/event_file_aedat4.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lz4frame.h>
#include <zstd.h>

#include "core/whole_file.h"
#include "sensors/events/event_file.h"
#include "tests/sensors/events/event_vectors.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using fixtures::number;
using test::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kVersion = "#!AER-DAT4.0\r\n";

std::string stream_of(int stream, const std::string& type, const std::string& info) {
  return "<node name=\"" + std::to_string(stream) +
         "\" path=\"/outInfo/\"><attr key=\"compression\" type=\"string\">LZ4</attr>" +
         "<attr key=\"typeIdentifier\" type=\"string\">" + type + "</attr><node name=\"info\" path=\"/\">" + info +
         "</node></node>";
}

const std::string kSize = "<attr key=\"sizeX\" type=\"int\">346</attr><attr key=\"sizeY\" type=\"int\">260</attr>";

/// The description of the streams, as DV writes it.
std::string info_of(const std::string& streams) {
  return "<dv version=\"2.0\"><node name=\"outInfo\" path=\"/mainloop/Recorder/outInfo/\">" + streams + "</node></dv>";
}

/// IOHeader with its size prefix. The vtable stands before the table: its own size, the table's, then where in the
/// table compression (int32), dataTablePosition (int64) and infoNode (offset of a string) are.
std::string header(int compression, std::int64_t table_at, const std::string& info) {
  std::string bytes = number(20, 4) + "IOHE";                                            // 0: the table stands at 20
  bytes += number(10, 2) + number(20, 2) + number(4, 2) + number(8, 2) + number(16, 2);  // 8: the vtable
  bytes += number(0, 2);                                                                 // 18
  bytes += number(12, 4) + number(compression, 4) + number(table_at, 8) + number(4, 4);  // 20: vtable at 20 - 12
  bytes += number(static_cast<std::int64_t>(info.size()), 4) + info + '\0';              // 40: the string, 4 on
  return kVersion + number(static_cast<std::int64_t>(bytes.size()), 4) + bytes;
}

/// EventPacket with its size prefix: a vector of 16 bytes an event (int64 time, int16 column and row, bool, 3 unused).
std::string packet_of(const std::vector<Event>& events) {
  std::string bytes = number(16, 4) + "EVTS";                          // 0: the table stands at 16
  bytes += number(6, 2) + number(8, 2) + number(4, 2) + number(0, 2);  // 8: the vtable
  bytes += number(8, 4) + number(4, 4);                                // 16: vtable at 16 - 8; the vector 4 on
  bytes += number(static_cast<std::int64_t>(events.size()), 4);        // 24
  for (const Event& event : events) {
    bytes += number(event.t_us, 8) + number(event.x, 2) + number(event.y, 2) + number(event.on ? 1 : 0, 4);
  }
  return number(static_cast<std::int64_t>(bytes.size()), 4) + bytes;
}

/// PacketHeader and content.
std::string in_stream(int stream, const std::string& content) {
  return number(stream, 4) + number(static_cast<std::int64_t>(content.size()), 4) + content;
}

std::string lz4(const std::string& content) {
  std::string frame(LZ4F_compressFrameBound(content.size(), nullptr), '\0');
  frame.resize(LZ4F_compressFrame(frame.data(), frame.size(), content.data(), content.size(), nullptr));
  return frame;
}

std::string zstd(const std::string& content) {
  std::string frame(ZSTD_compressBound(content.size()), '\0');
  frame.resize(ZSTD_compress(frame.data(), frame.size(), content.data(), content.size(), 3));
  return frame;
}

const std::vector<Event> kFirst{{1'584'108'002'921'424, 345, 259, true}, {1'584'108'002'921'425, 0, 0, false}};
const std::vector<Event> kSecond{{1'584'108'002'921'425, 7, 8, true}};

class Aedat4Events : public ::testing::Test {
 protected:
  EventRecording read(const std::string& content, std::optional<int> stream = {}) {
    return read_events(folder_.write("e.aedat4", content), {.size = {}, .stream = stream});
  }
  std::string refusal(const std::string& content, std::optional<int> stream = {}) {
    return message_of([&] { read(content, stream); });
  }
  test::TemporaryFolder folder_;
  const std::string info_ = info_of(stream_of(0, "EVTS", kSize));
};

TEST_F(Aedat4Events, SeveralPacketsOfEachCompression) {
  const std::vector<Event> all{kFirst[0], kFirst[1], kSecond[0]};
  const std::string first = packet_of(kFirst);
  const std::string second = packet_of(kSecond);
  const auto file = [&](int compression, const auto& pack) {
    return header(compression, -1, info_) + in_stream(0, pack(first)) + in_stream(0, pack(packet_of({}))) +
           in_stream(0, pack(second));
  };
  const EventRecording plain = read(file(0, [](const std::string& content) { return content; }));
  EXPECT_EQ(plain.events, all);
  EXPECT_EQ(plain.source.size, cv::Size(346, 260));
  EXPECT_EQ(read(file(1, lz4)).events, all);
  EXPECT_EQ(read(file(2, lz4)).events, all);
  EXPECT_EQ(read(file(3, zstd)).events, all);
  EXPECT_EQ(read(file(4, zstd)).events, all);
}

TEST_F(Aedat4Events, OtherStreamsAreCounted) {
  const std::string info = info_of(stream_of(0, "FRME", kSize) + stream_of(1, "IMUS", "") +
                                   stream_of(2, "EVTS", kSize) + stream_of(3, "TRIG", ""));
  const EventRecording back = read(header(0, -1, info) + in_stream(0, "a frame") + in_stream(3, "an edge") +
                                   in_stream(2, packet_of(kFirst)) + in_stream(1, "") + in_stream(3, "an edge"));
  EXPECT_EQ(back.events, kFirst);
  EXPECT_EQ(back.source.triggers, 2);
  EXPECT_EQ(back.source.others, 2);
}

TEST_F(Aedat4Events, TheTableOfPacketsEndsThem) {
  const std::string packets = in_stream(0, packet_of(kFirst));
  const auto table_at = static_cast<std::int64_t>(header(0, 0, info_).size() + packets.size());
  EXPECT_EQ(read(header(0, table_at, info_) + packets + "a table of packets").events, kFirst);
  EXPECT_THAT(refusal(header(0, table_at + 1, info_) + packets), AllOf(HasSubstr("table"), HasSubstr("broken off")));
  EXPECT_THAT(refusal(header(0, 20, info_) + packets), HasSubstr("byte 20"));
  EXPECT_THAT(refusal(header(0, table_at - 1, info_) + packets), HasSubstr("are left"));
}

TEST_F(Aedat4Events, OneOfSeveralStreamsMustBeChosen) {
  const std::string file = header(0, -1, info_of(stream_of(0, "EVTS", kSize) + stream_of(5, "EVTS", ""))) +
                           in_stream(0, packet_of(kFirst)) + in_stream(5, packet_of(kSecond));
  EXPECT_THAT(refusal(file), AllOf(HasSubstr("2 streams"), HasSubstr("0 EVTS, 5 EVTS")));
  EXPECT_EQ(read(file, 0).events, kFirst);
  EXPECT_EQ(read(file, 5).events, kSecond);
  EXPECT_EQ(read(file, 5).source.size, std::nullopt);
  EXPECT_THAT(refusal(file, 1), HasSubstr("no stream 1"));
}

TEST_F(Aedat4Events, HeadersThatArentReadAreReported) {
  EXPECT_THAT(refusal("#!AER-DAT3.1\r\n#Format: RAW\r\n"), AllOf(HasSubstr("#!AER-DAT3.1"), HasSubstr("4.0")));
  EXPECT_THAT(refusal("something else"), HasSubstr("isn't AEDAT"));
  EXPECT_THAT(refusal(kVersion + "ab"), HasSubstr("broken off"));
  EXPECT_THAT(refusal(kVersion + number(100, 4) + "too short"), AllOf(HasSubstr("100 bytes"), HasSubstr("byte 14")));
  EXPECT_THAT(refusal(kVersion + number(8, 4) + number(400, 4) + "IOHE"), HasSubstr("damaged"));
  EXPECT_THAT(refusal(kVersion + number(0, 4)), HasSubstr("damaged"));
  EXPECT_THAT(refusal(header(5, -1, info_)), AllOf(HasSubstr("compression is 5"), HasSubstr("0 to 4")));
  EXPECT_THAT(refusal(header(0, -1, "<dv><node")), HasSubstr("XML"));
  EXPECT_THAT(refusal(header(0, -1, info_of(stream_of(1, "FRME", kSize)))),
              AllOf(HasSubstr("no stream of events"), HasSubstr("1 FRME")));
  EXPECT_THAT(refusal(header(0, -1, info_of("<node name=\"first\"></node>"))), HasSubstr("'first'"));
  EXPECT_THAT(refusal(header(0, -1, info_of(stream_of(0, "EVTS", "<attr key=\"sizeX\">70000</attr>")))),
              HasSubstr("70000 x 0"));
}

TEST_F(Aedat4Events, DamagedPacketsAreReported) {
  const std::string head = header(0, -1, info_);
  const std::string at = "byte " + std::to_string(head.size());
  EXPECT_THAT(refusal(head + "abc"), AllOf(HasSubstr(at), HasSubstr("broken off after 3 bytes")));
  EXPECT_THAT(refusal(head + number(0, 4) + number(9, 4) + "short"), AllOf(HasSubstr(at), HasSubstr("5 are left")));
  EXPECT_THAT(refusal(head + number(0, 4) + number(-1, 4) + "short"), HasSubstr("has -1 bytes"));
  EXPECT_THAT(refusal(head + in_stream(9, packet_of(kFirst))), HasSubstr("stream 9"));
  EXPECT_THAT(refusal(head + in_stream(0, "abc")), HasSubstr("says that it has 0 bytes"));
  EXPECT_THAT(refusal(head + in_stream(0, number(50, 4) + "abc")), HasSubstr("50 bytes"));
  std::string wild = packet_of(kFirst);
  wild[20 + 4] = 100;  // the vector's offset leads out
  EXPECT_THAT(refusal(head + in_stream(0, wild)), HasSubstr("leads out"));
  std::string many = packet_of(kFirst);
  many[24 + 4] = 3;  // a third event that isn't there
  EXPECT_THAT(refusal(head + in_stream(0, many)), HasSubstr("leads out"));
  EXPECT_THAT(refusal(head + in_stream(0, packet_of({{5, 346, 0, true}}))), HasSubstr("columns 0 to 345"));
  EXPECT_THAT(refusal(head + in_stream(0, packet_of({{5, 0xFFFF, 0, true}}))), HasSubstr("columns 0 to 345"));
  EXPECT_THAT(refusal(head + in_stream(0, packet_of(kFirst)) + in_stream(0, packet_of({{5, 0, 0, true}}))),
              AllOf(HasSubstr("event 2"), HasSubstr("backwards")));
}

TEST_F(Aedat4Events, DamagedFramesAreReported) {
  const std::string frame = lz4(packet_of(kFirst));
  const auto with = [&](int compression, const std::string& content) {
    return refusal(header(compression, -1, info_) + in_stream(0, content));
  };
  EXPECT_THAT(with(1, "no frame at all"), HasSubstr("isn't a sound LZ4 frame"));
  EXPECT_THAT(with(1, frame.substr(0, frame.size() - 2)), HasSubstr("LZ4 frame that is broken off"));
  EXPECT_THAT(with(1, frame + "x"), HasSubstr("1 bytes behind"));
  const std::string other = zstd(packet_of(kFirst));
  EXPECT_THAT(with(3, "no frame at all"), HasSubstr("isn't a sound Zstandard frame"));
  EXPECT_THAT(with(3, other.substr(0, other.size() - 2)), HasSubstr("Zstandard frame that is broken off"));
  EXPECT_THAT(with(3, other + "x"), HasSubstr("1 bytes behind"));
}

TEST(PacketCompression, NothingUnpacksToMoreThanIsAllowed) {
  const std::string zeros(1 << 22, '\0');
  std::vector<char> content;
  for (const auto& [how, frame] :
       {std::pair(PacketCompression::lz4, lz4(zeros)), std::pair(PacketCompression::zstd, zstd(zeros)),
        std::pair(PacketCompression::none, zeros)}) {
    EXPECT_THAT(unpack(how, frame, zeros.size() - 1, content), HasSubstr("4194303"));
    EXPECT_LE(content.size(), zeros.size());
    EXPECT_EQ(unpack(how, frame, zeros.size() + 1, content), "");
    EXPECT_EQ(content.size(), zeros.size());
  }
}

TEST_F(Aedat4Events, WrittenFilesHaveATableOfTheirPackets) {
  const auto file = folder_.path() / "w.aedat4";
  EventWriter writer(file, {346, 260}, "<a & b>");
  writer.append(fixtures::bursts_of_events(20'000));
  writer.close();
  const std::string bytes = read_whole_file(file);
  // dataTablePosition: by the header's own vtable.
  const auto field = [](const std::string& buffer, std::size_t at, int width) {
    std::int64_t value = 0;
    for (int i = width; i-- > 0;)
      value = value << 8 | static_cast<unsigned char>(buffer[at + static_cast<std::size_t>(i)]);
    return value;
  };
  const std::size_t root = 18 + static_cast<std::size_t>(field(bytes, 18, 4));
  const std::size_t vtable = root - static_cast<std::size_t>(field(bytes, root, 4));
  const auto table_at =
      static_cast<std::size_t>(field(bytes, root + static_cast<std::size_t>(field(bytes, vtable + 6, 2)), 8));
  std::vector<char> table;
  ASSERT_EQ(unpack(PacketCompression::lz4, std::span(bytes).subspan(table_at), 1 << 20, table), "");
  EXPECT_EQ(std::string(table.data() + 8, 4), "FTAB");
  EXPECT_THAT(bytes, HasSubstr("&lt;a &amp; b&gt;"));
  EXPECT_EQ(bytes.substr(22, 4), "IOHE");
}

TEST_F(Aedat4Events, ACameraOfMoreThan32768IsRefused) {
  EXPECT_THAT(message_of([&] {
                EventWriter(folder_.path() / "w.aedat4", {10, 32'769}, "x");
              }),
              AllOf(HasSubstr("10 x 32769"), HasSubstr("32768")));
}

}  // namespace
}  // namespace touchstone::sensors
