// Words by hand, from Prophesee's description of EVT 3.0.

#include "sensors/events/event_file_evt3.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/whole_file.h"
#include "sensors/events/event_file.h"
#include "tests/sensors/events/event_vectors.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using fixtures::words;
using test::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A header as an EVK4 writes it.
constexpr const char* kHeader =
    "% camera_integrator_name Prophesee\n% date 2023-03-29 16:37:46\n% evt 3.0\n"
    "% format EVT3;height=720;width=1280\n% generation 4.2\n% geometry 1280x720\n% integrator_name Prophesee\n"
    "% plugin_name hal_plugin_imx636_evk4\n% serial_number 00ca0009\n% system_ID 49\n% end\n";

class Evt3Events : public ::testing::Test {
 protected:
  EventRecording read(const std::string& content) { return read_events(folder_.write("e.raw", content)); }
  EventRecording read_words(std::initializer_list<unsigned> values) { return read(kHeader + words(values)); }
  std::string refusal(const std::string& content) {
    return message_of([&] { read(content); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(Evt3Events, SingleEvents) {
  // TIME_HIGH 0x001, TIME_LOW 0x234, row 0x2CF, column 0x4FF ON, column 0 OFF, row 3 of a slave camera, column 5 ON.
  const EventRecording back = read_words({0x8001, 0x6234, 0x02CF, 0x2CFF, 0x2000, 0x0803, 0x2805});
  EXPECT_EQ(back.source.size, cv::Size(1280, 720));
  EXPECT_THAT(back.events,
              ElementsAre(Event{0x1234, 1279, 719, true}, Event{0x1234, 0, 719, false}, Event{0x1234, 5, 3, true}));
}

TEST_F(Evt3Events, VectorsCountOnFromTheirBase) {
  // Base 100 ON; 12 bits with 0 and 11 set; 8 bits with 1 and 7 set and the unused ones, too; 12 bits with 3 set.
  const EventRecording back = read_words({0x8000, 0x6001, 0x0002, 0x3864, 0x4801, 0x5F82, 0x4008});
  EXPECT_THAT(back.events, ElementsAre(Event{1, 100, 2, true}, Event{1, 111, 2, true}, Event{1, 113, 2, true},
                                       Event{1, 119, 2, true}, Event{1, 123, 2, true}));
}

TEST_F(Evt3Events, TheTimeIsThatOfTheLastTimeLow) {
  // TIME_HIGH is repeated every 16 us and says nothing by itself: an event before the next TIME_LOW keeps its time.
  const EventRecording back =
      read_words({0x8000, 0x6FFF, 0x0001, 0x2001, 0x8000, 0x2002, 0x8001, 0x2003, 0x6000, 0x2004});
  EXPECT_THAT(back.events, ElementsAre(Event{4095, 1, 1, false}, Event{4095, 2, 1, false}, Event{4095, 3, 1, false},
                                       Event{4096, 4, 1, false}));
}

TEST_F(Evt3Events, TheClockWrapsEvery16777216Us) {
  const EventRecording back = read_words(
      {0x8FFF, 0x6FFF, 0x0001, 0x2001, 0x8000, 0x6000, 0x2002, 0x8FFF, 0x6000, 0x2003, 0x8000, 0x6001, 0x2004});
  EXPECT_THAT(back.events,
              ElementsAre(Event{16'777'215, 1, 1, false}, Event{16'777'216, 2, 1, false},
                          Event{2 * 16'777'216 - 4096, 3, 1, false}, Event{2 * 16'777'216 + 1, 4, 1, false}));
}

TEST_F(Evt3Events, TriggersAndWordsOfTheMakersOwnAreCounted) {
  // A trigger may have an earlier TIME_LOW than the events about it: sources keep their own order only.
  const EventRecording back =
      read_words({0x8000, 0x6020, 0x0001, 0x2001, 0x6010, 0xA101, 0x6020, 0x2002, 0xE123, 0xF456, 0x7007, 0xA100});
  EXPECT_THAT(back.events, ElementsAre(Event{32, 1, 1, false}, Event{32, 2, 1, false}));
  EXPECT_EQ(back.source.triggers, 2);
  EXPECT_EQ(back.source.others, 3);
}

TEST_F(Evt3Events, WhatComesBeforeTheFirstTimeAndRowIsCounted) {
  const EventRecording back =
      read_words({0x0001, 0x2001, 0x6005, 0x2002, 0x3000, 0x4007, 0x8001, 0x2003, 0x6005, 0x2004});
  EXPECT_THAT(back.events, ElementsAre(Event{4101, 4, 1, false}));
  EXPECT_EQ(back.source.unplaced, 6);
  EXPECT_EQ(read_words({0x8001, 0x6005, 0x2001}).source.unplaced, 1) << "no row yet";
}

TEST_F(Evt3Events, HeadersOfOtherKindsOfCameras) {
  const std::string events = words({0x8000, 0x6001, 0x0002, 0x2003});
  // An older one: no format, no end; the data begin where a line doesn't begin with "% ".
  EXPECT_EQ(
      read("% date 2020-09-14 14:18:29\n% integrator_name Prophesee\n% evt 3.0\n% width 640\n% height 480\n" + events)
          .source.size,
      cv::Size(640, 480));
  EXPECT_EQ(read("% evt 3.0\n" + events).source.size, std::nullopt);
  EXPECT_EQ(read("% format EVT3\r\n% end\r\n" + events).events.size(), 1u);
  EXPECT_EQ(read("% evt 3.0\n% endianness little\n" + events).events.size(), 1u);
}

TEST_F(Evt3Events, HeadersThatArentReadAreReported) {
  EXPECT_THAT(refusal("% evt 2.0\n% end\n"), AllOf(HasSubstr("e.raw:1"), HasSubstr("'2.0'"), HasSubstr("3.0")));
  EXPECT_THAT(refusal("% format EVT21;height=7;width=9\n% end\n"), AllOf(HasSubstr("EVT21"), HasSubstr("EVT3")));
  EXPECT_THAT(refusal("% date today\n% end\n"), HasSubstr("doesn't say its encoding"));
  EXPECT_THAT(refusal(words({0x8000, 0x6001})), HasSubstr("doesn't say its encoding"));
  EXPECT_THAT(refusal("% evt 3.0\n% date"), AllOf(HasSubstr("e.raw:2"), HasSubstr("broken off")));
  EXPECT_THAT(refusal("% evt 3.0\n% geometry 1280\n"), HasSubstr("1280x720"));
  EXPECT_THAT(refusal("% evt 3.0\n% geometry 0x720\n"), AllOf(HasSubstr("'0'"), HasSubstr("2048")));
  EXPECT_THAT(refusal("% evt 3.0\n% width 640\n"), HasSubstr("both"));
  EXPECT_THAT(refusal("% evt 3.0\n% endianness big\n"), HasSubstr("'big'"));
  EXPECT_THAT(refusal("% format EVT3;endianness=big\n"), HasSubstr("endianness=big"));
  EXPECT_THAT(refusal("% evt 3.0\n% touchstone_t_offset_us 5\n"), HasSubstr("multiple"));
}

TEST_F(Evt3Events, DamagedWordsAreReported) {
  const std::string head = "% evt 3.0\n% geometry 640x480\n% end\n";
  EXPECT_THAT(refusal(head + words({0x8000, 0x6001}) + "x"), HasSubstr("within a word"));
  EXPECT_THAT(refusal(head + words({0x8000, 0x1234})),
              AllOf(HasSubstr("0x1234"), HasSubstr("byte " + std::to_string(head.size() + 2)), HasSubstr("type 0x1")));
  EXPECT_THAT(refusal(head + words({0x8000, 0x6001, 0x0001, 0x2280})), HasSubstr("columns 0 to 639"));
  EXPECT_THAT(refusal(head + words({0x8000, 0x6001, 0x01E0, 0x2000})), HasSubstr("rows 0 to 479"));
  EXPECT_THAT(refusal(head + words({0x8000, 0x6002, 0x0001, 0x2001, 0x6001, 0x2001})),
              AllOf(HasSubstr("event 1"), HasSubstr("1 us"), HasSubstr("2 us")));
  EXPECT_THAT(refusal(head + words({0x8010, 0x6002, 0x0001, 0x2001, 0x800F, 0x6002, 0x2001})), HasSubstr("backwards"))
      << "a step down that is no wrap";
  std::string run_away = head + words({0x8000, 0x6001, 0x0001, 0x3000});
  for (int i = 0; i < 6000; ++i) run_away += words({0x4000});
  EXPECT_THAT(refusal(run_away + words({0x4001})), HasSubstr("columns 0 to 639")) << "a base beyond 16 bits";
}

TEST_F(Evt3Events, WrittenWordsAreThoseOfTheDescription) {
  EventWriter writer(folder_.path() / "w.raw", {1280, 720}, "touchstone test");
  std::vector<Event> events{{0x1234, 5, 7, true}, {0x1234, 9, 7, true}};              // two: words of their own
  for (std::uint16_t x = 100; x < 120; ++x) events.push_back({0x1234, x, 7, false});  // twenty: vectors of 12 and 8
  events.push_back({0x1235, 1, 7, true});                                             // the row stays
  writer.append(events);
  writer.close();
  const std::string bytes = read_whole_file(folder_.path() / "w.raw");
  const std::string end = "% end\n";
  EXPECT_EQ(bytes.substr(0, 10), "% evt 3.0\n");
  EXPECT_EQ(bytes.substr(bytes.find(end) + end.size()),
            words({0x8001, 0x6234, 0x0007, 0x2805, 0x2809, 0x3064, 0x4FFF, 0x50FF, 0x6235, 0x2801}));
}

TEST_F(Evt3Events, ACameraOfMoreThan2048IsRefused) {
  EXPECT_THAT(message_of([&] {
                EventWriter(folder_.path() / "w.raw", {2049, 10}, "x");
              }),
              AllOf(HasSubstr("2049 x 10"), HasSubstr("2048")));
}

}  // namespace
}  // namespace touchstone::sensors
