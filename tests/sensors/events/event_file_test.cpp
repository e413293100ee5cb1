#include "sensors/events/event_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "core/whole_file.h"
#include "tests/sensors/events/event_vectors.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

// LeakSanitizer: HDF5 1.10 keeps some memory of damaged files that it has refused.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libhdf5";
}

namespace touchstone::sensors {
namespace {

namespace fs = std::filesystem;
using fixtures::bursts_of_events;
using fixtures::kHeight;
using fixtures::kWidth;
using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

void write_events(const fs::path& file, const std::vector<Event>& events, std::size_t portion = 1000) {
  EventWriter writer(file, {kWidth, kHeight}, "touchstone test");
  for (std::size_t i = 0; i < events.size(); i += portion) {
    writer.append(std::span(events).subspan(i, std::min(portion, events.size() - i)));
  }
  writer.close();
}

class EventFile : public ::testing::TestWithParam<const char*> {
 protected:
  fs::path file(const std::string& name) const { return folder_.path() / (name + GetParam()); }
  test::TemporaryFolder folder_;
};

TEST_P(EventFile, ReadsBackWhatWasWritten) {
  const std::vector<Event> events = bursts_of_events(200'000);
  ASSERT_GT(events.back().t_us, 16'777'216) << "EVT 3.0's clock should wrap";
  write_events(file("a"), events);
  const EventRecording back = read_events(file("a"));
  EXPECT_EQ(back.source.size, cv::Size(kWidth, kHeight));
  EXPECT_EQ(back.source.events, 200'000);
  EXPECT_EQ(back.source.triggers + back.source.unplaced + back.source.others, 0);
  EXPECT_TRUE(back.events == events);
}

TEST_P(EventFile, TimesFarFromZeroComeBack) {
  // Since 1970, before a clock's start, over two hours of silence, and beside the wraps of a clock of 24 bits.
  for (const std::int64_t first_us :
       std::initializer_list<std::int64_t>{1'600'000'000'123'456, -1'234'567, 16'777'215, 33'554'432}) {
    std::vector<Event> events = bursts_of_events(100, 2, first_us);
    const Event last = events.back();
    if (std::string(GetParam()) != ".h5") events.push_back({last.t_us + 7'200'000'000, 1, 2, true});
    events.push_back({events.back().t_us + 8'388'608, 1, 2, true});   // half a wrap
    events.push_back({events.back().t_us + 16'777'216, 1, 2, true});  // a wrap
    write_events(file("a"), events);
    EXPECT_TRUE(read_events(file("a")).events == events) << first_us;
  }
}

TEST_P(EventFile, TheSameEventsGiveTheSameBytesForAnyPortions) {
  const std::vector<Event> events = bursts_of_events(150'000);
  write_events(file("a"), events, 777);
  write_events(file("b"), events, 150'000);
  EXPECT_EQ(read_whole_file(file("a")), read_whole_file(file("b")));
}

TEST_P(EventFile, NoEventsAreARecordingToo) {
  write_events(file("a"), {});
  const EventRecording back = read_events(file("a"));
  EXPECT_TRUE(back.events.empty());
  EXPECT_EQ(back.source.size, cv::Size(kWidth, kHeight));
  EventReader reader(file("a"));
  EXPECT_TRUE(reader.next().empty());
  EXPECT_TRUE(reader.next().empty());
}

TEST_P(EventFile, PortionsHoldAllAndStaySmall) {
  const std::vector<Event> events = bursts_of_events(300'000);
  write_events(file("a"), events);
  EventReader reader(file("a"));
  std::size_t at = 0;
  for (auto portion = reader.next(); !portion.empty(); portion = reader.next()) {
    ASSERT_LE(portion.size(), kEventPortion + 12);
    ASSERT_TRUE(std::equal(portion.begin(), portion.end(), events.begin() + static_cast<std::ptrdiff_t>(at)));
    at += portion.size();
    EXPECT_EQ(reader.source().events, static_cast<std::int64_t>(at));
  }
  EXPECT_EQ(at, events.size());
}

TEST_P(EventFile, WhatDoesntFitIsntWritten) {
  EventWriter writer(file("a"), {kWidth, kHeight}, "touchstone test");
  writer.append(std::vector<Event>{{100, 1, 1, true}});
  const auto refused = [&](const Event& event) {
    return message_of([&] { writer.append(std::vector<Event>{event}); });
  };
  EXPECT_THAT(refused({99, 1, 1, true}), AllOf(HasSubstr("event 1"), HasSubstr("99 us"), HasSubstr("100 us")));
  EXPECT_THAT(refused({100, kWidth, 1, true}), AllOf(HasSubstr("column 346"), HasSubstr("columns 0 to 345")));
  EXPECT_THAT(refused({100, 1, kHeight, true}), HasSubstr("rows 0 to 259"));
  EXPECT_THAT(message_of([&] { EventWriter(file("b"), {0, 5}, "x"); }), HasSubstr("0 x 5 pixels"));
  EXPECT_THAT(message_of([&] { write_events(file("none/a"), {}); }), HasSubstr("can't be written"));
}

// It isn't opened, which would wait for who writes into it.
TEST_P(EventFile, APipeIsRefusedAtOnce) {
  ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
  EXPECT_THAT(message_of([&] { read_events(file("pipe")); }), HasSubstr("there is no such file"));
}

TEST_P(EventFile, AnEmptyFileAndAnotherCameraAreRefused) {
  folder_.write(std::string("empty") + GetParam(), "");
  EXPECT_THAT(message_of([&] { read_events(file("empty")); }), HasSubstr("is empty"));
  EXPECT_THAT(message_of([&] { read_events(file("none")); }), HasSubstr("there is no such file"));
  write_events(file("a"), bursts_of_events(10));
  EXPECT_THAT(message_of([&] { read_events(file("a"), {.size = cv::Size(240, 180), .stream = {}}); }),
              AllOf(HasSubstr("346 x 260"), HasSubstr("240 x 180")));
  EXPECT_THAT(message_of([&] { read_events(file("a"), {.size = cv::Size(0, 180), .stream = {}}); }),
              HasSubstr("0 x 180"));
}

TEST_P(EventFile, AFullDiskIsAnError) {
  ASSERT_TRUE(fs::exists("/dev/full")) << "Linux has it; what a full disk does can't be tested without";
  fs::create_symlink("/dev/full", file("full"));
  EXPECT_THAT(message_of([&] { write_events(file("full"), bursts_of_events(1000)); }), HasSubstr("can't be written"));
}

// Text has no mark at its beginning: the name tells it.
TEST(EventFiles, ContentTellsTheFormatWhateverTheName) {
  const test::TemporaryFolder folder;
  const std::vector<Event> events = bursts_of_events(10);
  for (const char* format : {".h5", ".raw", ".aedat4"}) {
    const fs::path named = folder.path() / (std::string("a") + format);
    write_events(named, events);
    fs::rename(named, folder.path() / "a.bin");
    EXPECT_TRUE(read_events(folder.path() / "a.bin").events == events) << format;
  }
}

/// A reader's answer to damage: an Error that names the file, or events that are all within the picture and in order.
void expect_sound_or_refused(const fs::path& file, const std::string& what) {
  try {
    const EventRecording back = read_events(file);
    const cv::Size size = back.source.size.value_or(cv::Size(65536, 65536));
    for (std::size_t i = 0; i < back.events.size(); ++i) {
      ASSERT_LT(back.events[i].x, size.width) << what;
      ASSERT_LT(back.events[i].y, size.height) << what;
      ASSERT_TRUE(i == 0 || back.events[i].t_us >= back.events[i - 1].t_us) << what;
    }
  } catch (const Error& error) {
    ASSERT_THAT(error.what(), HasSubstr(file.filename().string())) << what;
  }
}

TEST_P(EventFile, CutAtAnyByteGivesTheBeginningOrAnError) {
  const std::vector<Event> events = bursts_of_events(12);
  write_events(file("a"), events);
  const std::string bytes = read_whole_file(file("a"));
  const std::size_t step = bytes.size() > 4000 ? 97 : 1;  // HDF5: each is tried in a process of its own
  for (std::size_t length = 1; length < bytes.size(); length += step) {
    folder_.write(std::string("cut") + GetParam(), bytes.substr(0, length));
    std::vector<Event> back;
    try {
      EventReader reader(file("cut"));
      for (auto portion = reader.next(); !portion.empty(); portion = reader.next()) {
        back.insert(back.end(), portion.begin(), portion.end());
      }
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("cut")) << length;
    }
    ASSERT_LE(back.size(), events.size());
    EXPECT_TRUE(std::equal(back.begin(), back.end(), events.begin())) << "cut to " << length;
  }
}

TEST_P(EventFile, FlippedBitsGiveSoundEventsOrAnError) {
  write_events(file("a"), bursts_of_events(40));
  const std::string bytes = read_whole_file(file("a"));
  const std::size_t step = bytes.size() > 4000 ? 89 : 1;
  for (std::size_t i = 0; i < bytes.size(); i += step) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ (1 << (i % 8)));
    folder_.write(std::string("flip") + GetParam(), flipped);
    expect_sound_or_refused(file("flip"), "byte " + std::to_string(i));
  }
}

TEST_P(EventFile, RandomBytesGiveSoundEventsOrAnError) {
  write_events(file("a"), bursts_of_events(40));
  const std::string sound = read_whole_file(file("a"));
  std::uint64_t state = 7;
  const auto below = [&](std::uint64_t n) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (state >> 33) % n;
  };
  const int trials = std::string(GetParam()) == ".h5" ? 60 : 300;
  for (int trial = 0; trial < trials; ++trial) {
    std::string bytes = sound.substr(0, below(sound.size()));  // some sound beginning, or next to none
    const std::uint64_t length = 1 + below(2000);
    for (std::uint64_t i = 0; i < length; ++i) bytes += static_cast<char>(below(256));
    folder_.write(std::string("random") + GetParam(), bytes);
    expect_sound_or_refused(file("random"), "trial " + std::to_string(trial));
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, EventFile, ::testing::Values(".txt", ".csv", ".h5", ".raw", ".aedat4"),
                         [](const auto& ending) { return std::string(ending.param).substr(1); });

TEST(EventFileNames, OtherEndingsAreRefused) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(message_of([] { event_format_of_name("a.mp4"); }), AllOf(HasSubstr("a.mp4"), HasSubstr(".aedat4")));
  EXPECT_EQ(event_format_of_name("a.hdf5"), EventFormat::dsec);
  EXPECT_THAT(message_of([&] { read_events(folder.write("a.dat", "nothing known")); }), HasSubstr("a.dat"));
}

}  // namespace
}  // namespace touchstone::sensors
