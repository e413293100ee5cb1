#include "sensors/events/event_file_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/whole_file.h"
#include "sensors/events/event_file.h"
#include "tests/sensors/events/event_vectors.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class TextEvents : public ::testing::Test {
 protected:
  EventRecording read(const std::string& content) { return read_events(folder_.write("e.txt", content)); }
  std::string refusal(const std::string& content) {
    return message_of([&] { read(content); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(TextEvents, SecondsWithoutAHeader) {
  // The layout of [Mueggler2017]: seconds, column, row, polarity; nine decimals, rounded to us.
  const EventRecording back = read("0.003811000 96 133 0\n0.0038115 96 134 1\r\n1e-2 0 0 1\n1.5e0 3 4 0");
  EXPECT_THAT(back.events, ElementsAre(Event{3811, 96, 133, false}, Event{3812, 96, 134, true},
                                       Event{10000, 0, 0, true}, Event{1'500'000, 3, 4, false}));
  EXPECT_EQ(back.source.size, std::nullopt);
}

TEST_F(TextEvents, AMarkOfUtf8IsPassedOver) {
  EXPECT_THAT(read("\xef\xbb\xbft_us,x,y,p\r\n5,1,2,1\r\n").events, ElementsAre(Event{5, 1, 2, true}));
  EXPECT_THAT(read("\xef\xbb\xbf"
                   "5 1 2 1\n")
                  .events,
              ElementsAre(Event{5, 1, 2, true}));
}

TEST_F(TextEvents, TimesInThePlaceOfRowsAreSeenWithoutNames) {
  const std::string events = "1 2 64930 1\n1 7 64935 0\n3 1 64942 1\n";
  EXPECT_THAT(refusal(events), AllOf(HasSubstr("e.txt:1: '64930' would be a column or row of a camera"),
                                     HasSubstr("without a line of names fields are t x y p")));
  EXPECT_THAT(read("x y t_us p\n" + events).events,
              ElementsAre(Event{64930, 1, 2, true}, Event{64935, 1, 7, false}, Event{64942, 3, 1, true}));
  // Who says that the camera is so large is believed.
  EXPECT_EQ(read("# width 10\n# height 65536\n" + events).events.size(), 3u);
  EXPECT_EQ(read("t_us x y p\n" + events).events.size(), 3u);
}

TEST_F(TextEvents, PolaritiesHaveSeveralForms) {
  EXPECT_THAT(read("1 0 0 True\n2 0 0 False\n3 0 0 +1\n4 0 0 -1\n5 0 0 true\n6 0 0 0\n").events,
              ElementsAre(Event{1, 0, 0, true}, Event{2, 0, 0, false}, Event{3, 0, 0, true}, Event{4, 0, 0, false},
                          Event{5, 0, 0, true}, Event{6, 0, 0, false}));
  EXPECT_THAT(refusal("1 0 0 2\n"), HasSubstr("isn't a polarity"));
}

TEST_F(TextEvents, SecondsSince1970AreRoundedRightly) {
  EXPECT_THAT(read("1468940293.922985274 1 2 1\n").events, ElementsAre(Event{1468940293922985, 1, 2, true}));
}

TEST_F(TextEvents, MicrosecondsWithoutAHeader) {
  EXPECT_THAT(read("-5 1 2 1\n17,3,4,-1\n 18\t5 , 6 1 \n").events,
              ElementsAre(Event{-5, 1, 2, true}, Event{17, 3, 4, false}, Event{18, 5, 6, true}));
}

TEST_F(TextEvents, SizeAheadOfTheEvents) {
  // The layout of E2VID [Rebecq2021]: a first line of width and height.
  const EventRecording back = read("240 180\n0.5 239 179 1\n");
  EXPECT_EQ(back.source.size, cv::Size(240, 180));
  EXPECT_THAT(back.events, ElementsAre(Event{500'000, 239, 179, true}));
  EXPECT_THAT(refusal("240 180\n0.5 240 179 1\n"), AllOf(HasSubstr("line 2"), HasSubstr("columns 0 to 239")));
}

TEST_F(TextEvents, NamesSayOrderAndUnit) {
  EXPECT_THAT(read("x,y,p,t_us\n1,2,0,77\n").events, ElementsAre(Event{77, 1, 2, false}));
  EXPECT_THAT(read("# p t_s x y\n1 2 3 4\n").events, ElementsAre(Event{2'000'000, 3, 4, true}));
  EXPECT_THAT(refusal("a b c d\n"), AllOf(HasSubstr("e.txt:1"), HasSubstr("isn't a line of names")));
  EXPECT_THAT(refusal("t_us x x p\n"), HasSubstr("each once"));
}

TEST_F(TextEvents, TheWholeFileIsWhatTheFormatSays) {
  EventWriter writer(folder_.path() / "w.txt", {240, 180}, "touchstone 0.1.0");
  writer.append(std::vector<Event>{{5, 1, 2, true}, {5, 3, 2, false}});
  writer.close();
  EXPECT_EQ(read_whole_file(folder_.path() / "w.txt"),
            "# touchstone-events 2\n# program touchstone 0.1.0\n# width 240\n# height 180\n# t_us x y p\n"
            "5 1 2 1\n5 3 2 0\n");
  EventWriter table(folder_.path() / "w.csv", {240, 180}, "touchstone 0.1.0");
  table.append(std::vector<Event>{{5, 1, 2, true}});
  table.close();
  EXPECT_THAT(read_whole_file(folder_.path() / "w.csv"), HasSubstr("\nt_us,x,y,p\n5,1,2,1\n"));
}

TEST_F(TextEvents, FaultsNameTheLineTheValueAndWhatIsAllowed) {
  EXPECT_THAT(refusal("# c\n\n5 1 2\n"), AllOf(HasSubstr("e.txt:3"), HasSubstr("3 fields")));
  EXPECT_THAT(refusal("5 1 2 1 9\n"), AllOf(HasSubstr("'9'"), HasSubstr("four")));
  EXPECT_THAT(refusal("5 1 2 2\n"), AllOf(HasSubstr("'2'"), HasSubstr("polarity")));
  EXPECT_THAT(refusal("5 -1 2 1\n"), AllOf(HasSubstr("'-1'"), HasSubstr("0 to 65535")));
  EXPECT_THAT(refusal("5 1 65536 1\n"), HasSubstr("65536"));
  EXPECT_THAT(refusal("5 1.5 2 1\n"), HasSubstr("1.5"));
  EXPECT_THAT(refusal("5 1 2 1\n5.5 1 2 1\n"), AllOf(HasSubstr("e.txt:2"), HasSubstr("whole number of us")));
  EXPECT_THAT(refusal("1234567890123456789 1 2 1\n0 1 2 1\n"), HasSubstr("in seconds"));
  EXPECT_THAT(refusal("nan 1 2 1\n"), HasSubstr("isn't a line of names"));
  EXPECT_THAT(refusal("0.5 1 2 1\nnan 1 2 1\n"), HasSubstr("in seconds"));
  EXPECT_THAT(refusal("1e300 1 2 1\n"), HasSubstr("in seconds"));
  EXPECT_THAT(refusal("5 1 2 1\n4 1 2 1\n"), AllOf(HasSubstr("line 2"), HasSubstr("4 us"), HasSubstr("5 us")));
  EXPECT_THAT(refusal("# touchstone-events 3\n5 1 2 1\n"), HasSubstr("version 3"));
  EXPECT_THAT(refusal("# width 10\n5 1 2 1\n"), HasSubstr("both"));
  EXPECT_THAT(refusal("# width 0\n# height 3\n5 1 2 1\n"), HasSubstr("0 x 3"));
  EXPECT_THAT(refusal("10 b\n5 1 2 1\n"), AllOf(HasSubstr("'b'"), HasSubstr("width and height")));
}

TEST_F(TextEvents, AGivenSizeIsKept) {
  const auto file = folder_.write("e.txt", "5 240 2 1\n");
  EXPECT_THAT(message_of([&] { read_events(file, {.size = cv::Size(240, 180), .stream = {}}); }),
              HasSubstr("columns 0 to 239"));
  EXPECT_EQ(read_events(file, {.size = cv::Size(241, 180), .stream = {}}).source.size, cv::Size(241, 180));
}

}  // namespace
}  // namespace touchstone::sensors
