#include "sensors/events/event_windows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/random.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::ElementsAre;
using testing::HasSubstr;

const EventWindowSettings kSmall{.start_us = 100, .length_us = 10, .size = {4, 3}, .region = {}};

TEST(EventWindows, CountsHalfOpenWindowsAndEmptyOnes) {
  const std::vector<Event> events{{99, 0, 0, true},   {100, 0, 0, true}, {109, 1, 1, false}, {110, 0, 0, false},
                                  {110, 3, 2, false}, {140, 0, 0, true}, {149, 0, 0, true}};
  const auto windows = count_windows(events, kSmall, 160);
  EXPECT_THAT(windows, ElementsAre(EventCounts{1, 1}, EventCounts{0, 2}, EventCounts{0, 0}, EventCounts{0, 0},
                                   EventCounts{2, 0}, EventCounts{0, 0}));
  EventWindows counting(kSmall);
  counting.add(events);
  EXPECT_EQ(counting.before_start(), 1);
  EXPECT_EQ(counting.events(), 7);
  EXPECT_EQ(counting.finished().size(), 4U);  // an event at 149 may be followed by another of the same window
}

TEST(EventWindows, ALastWindowThatIsNotWholeIsLeftOut) {
  EXPECT_EQ(count_windows(std::vector<Event>{{105, 0, 0, true}}, kSmall, 109).size(), 0U);
  EXPECT_EQ(count_windows(std::vector<Event>{{105, 0, 0, true}}, kSmall, 110).size(), 1U);
  EXPECT_EQ(count_windows({}, kSmall, 131).size(), 3U);
  EXPECT_EQ(count_windows({}, kSmall, 5).size(), 0U);
}

TEST(EventWindows, AnyPortionsGiveTheSame) {
  RandomStream random(1, 0, Purpose::kTest);
  std::vector<Event> events;
  std::int64_t t = 50;
  for (int i = 0; i < 2000; ++i) {
    t += static_cast<std::int64_t>(random.uniform() < 0.01 ? 40.0 * random.uniform() : 3.0 * random.uniform());
    events.push_back({t, static_cast<std::uint16_t>(4.0 * random.uniform()),
                      static_cast<std::uint16_t>(3.0 * random.uniform()), random.uniform() < 0.4});
  }
  const auto whole = count_windows(events, kSmall, t + 1);
  std::int64_t sum = 0;
  for (const EventCounts& window : whole) sum += window.on + window.off;
  for (const std::size_t portion : {std::size_t{1}, std::size_t{7}, std::size_t{300}}) {
    EventWindows counting(kSmall);
    for (std::size_t i = 0; i < events.size(); i += portion) {
      counting.add(std::span(events).subspan(i, std::min(portion, events.size() - i)));
    }
    counting.end_at(t + 1);
    EXPECT_TRUE(std::equal(whole.begin(), whole.end(), counting.finished().begin(), counting.finished().end()));
    // Nothing is lost: what isn't in a window lies before the first one, or in the last, unfinished one.
    EXPECT_LE(sum + counting.before_start(), counting.events());
    counting.end_at(t + 20);
    sum = 0;
    for (const EventCounts& window : counting.finished()) sum += window.on + window.off;
    EXPECT_EQ(sum + counting.before_start(), counting.events());
    sum = 0;
    for (const EventCounts& window : whole) sum += window.on + window.off;
  }
}

TEST(EventWindows, OnlyTheRegionCounts) {
  EventWindowSettings settings = kSmall;
  settings.region = {1, 1, 2, 2};
  EventWindows counting(settings);
  counting.add(std::vector<Event>{{100, 0, 1, true}, {101, 1, 1, true}, {102, 2, 2, false}, {103, 3, 2, false}});
  counting.end_at(110);
  EXPECT_THAT(counting.finished(), ElementsAre(EventCounts{1, 1}));
  EXPECT_EQ(counting.beside_region(), 2);
}

TEST(EventWindows, FaultyEventsAreNamedAndThoseBeforeAreKept) {
  const auto fault = [](const Event& faulty) {
    EventWindows counting(kSmall);
    const std::vector<Event> events{{100, 0, 0, true}, {105, 1, 0, true}, faulty};
    const std::string message = message_of([&] { counting.add(events); });
    EXPECT_EQ(counting.events(), 2);
    counting.add(std::vector<Event>{{106, 0, 0, true}});
    counting.end_at(110);
    EXPECT_EQ(counting.finished().front().on, 3);
    return message;
  };
  EXPECT_THAT(fault({104, 0, 0, true}), HasSubstr("event 2: its time is 104 us, that of the one before is 105 us"));
  EXPECT_THAT(fault({106, 4, 0, true}), HasSubstr("event 2: its pixel is (4, 0), the camera has 4 x 3"));
  EXPECT_THAT(fault({106, 0, 3, true}), HasSubstr("(0, 3)"));
  EXPECT_THAT(fault({std::numeric_limits<std::int64_t>::max(), 0, 0, true}), HasSubstr("only 10000000 windows"));
  // Across portions, and after the end was announced.
  EventWindows counting(kSmall);
  counting.add(std::vector<Event>{{120, 0, 0, true}});
  EXPECT_THAT(message_of([&] { counting.add(std::vector<Event>{{119, 0, 0, true}}); }), HasSubstr("event 1"));
  counting.end_at(130);
  EXPECT_THAT(message_of([&] { counting.add(std::vector<Event>{{129, 0, 0, true}}); }), HasSubstr("backwards"));
  EXPECT_THAT(message_of([&] { counting.end_at(std::numeric_limits<std::int64_t>::max()); }), HasSubstr("more than"));
  EXPECT_THAT(message_of([] {
                count_windows(std::vector<Event>{{120, 0, 0, true}}, kSmall, 120);
              }),
              HasSubstr("ends at 120 us"));
}

TEST(EventWindows, FaultySettingsAreNamed) {
  const auto fault = [](auto spoil) {
    EventWindowSettings settings = kSmall;
    spoil(settings);
    return message_of([&] { EventWindows{settings}; });
  };
  EXPECT_THAT(fault([](auto& s) { s.length_us = 0; }), HasSubstr("length_us is 0"));
  EXPECT_THAT(fault([](auto& s) { s.start_us = std::numeric_limits<std::int64_t>::min(); }), HasSubstr("start_us"));
  EXPECT_THAT(fault([](auto& s) { s.size = {0, 3}; }), HasSubstr("0 x 3 px"));
  EXPECT_THAT(fault([](auto& s) { s.region = {2, 0, 3, 1}; }), HasSubstr("within the 4 x 3 px"));
}

}  // namespace
}  // namespace touchstone::sensors
