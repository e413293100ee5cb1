// The hard case of time stamps, 44, of what estimators are given: frames and events whose time is that of the one
// before or earlier. Of each estimator there are two: one is also given what must be refused, and then goes on as the
// other.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sensors/beads/bead_tracker.h"
#include "sensors/events/event_file.h"
#include "sensors/events/event_windows.h"
#include "sensors/markers/marker_tracker.h"
#include "sensors/markers/touch_reader.h"
#include "sensors/reflex/explore_tracker.h"
#include "sensors/reflex/reflex_loop.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/sensors/beads/rendered_beads.h"
#include "tests/sensors/markers/painted_marked_gel.h"
#include "tests/sensors/markers/painted_markers.h"
#include "tests/sensors/reflex/painted_fingertip.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using test::did;
using test::message_of;
using test::refused;
using ::testing::HasSubstr;

constexpr std::int64_t kEarliest = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kLatest = std::numeric_limits<std::int64_t>::max();

/// Times that mustn't follow 1000 us: the earliest there is, another clock's, one microsecond back, and the same again.
constexpr std::int64_t kBadTimes_us[] = {kEarliest, -5'000'000, 999, 1000};

TEST(HardCase44, TheBeadTrackerRefusesAndGoesOn) {
  fixtures::BeadPainter painter({});
  std::vector<Eigen::Vector2d> places = fixtures::grid_positions(3, 71.0, {320.0, 240.0});
  BeadTracker tracker({});
  BeadTracker other({});
  std::string said;
  const auto expect_same = [&](const Frame& frame) {
    const TrackedBeads wanted = other.track(frame);
    const TrackedBeads& found = tracker.track(frame);
    EXPECT_EQ(found.positions, wanted.positions);
    EXPECT_EQ(found.t_us, wanted.t_us);
    EXPECT_EQ(found.found(), 9);
    for (const Eigen::Vector2d& place : found.positions) EXPECT_TRUE(place.allFinite());
  };
  expect_same({painter.paint(places), kEarliest});  // any first time is one
  for (Eigen::Vector2d& place : places) place.x() += 2.0;
  expect_same({painter.paint(places), 1000});
  for (const std::int64_t t_us : kBadTimes_us) {
    said = message_of([&] { tracker.track({painter.paint(places), t_us}); });
    EXPECT_THAT(said, HasSubstr("times must increase"));
    EXPECT_THAT(said, HasSubstr(fmt::format("t = {} us follows one at t = 1000 us", t_us)));
  }
  for (Eigen::Vector2d& place : places) place.x() += 1.0;
  expect_same({painter.paint(places), 1001});
  expect_same({painter.paint(places), kLatest});
  did("vhs, bead tracker: a frame at 1000, 999, -5e6 and -9.2e18 us after one at 1000 us is {}; then both trackers "
      "have "
      "the same bits",
      refused(said));
}

TEST(HardCase44, TheMarkerTrackerRefusesAndGoesOn) {
  std::vector<Eigen::Vector2d> places = fixtures::marker_grid();
  MarkerTracker tracker({});
  MarkerTracker other({});
  const auto expect_same = [&](const Frame& frame) {
    const TrackedMarkers wanted = other.track(frame);
    const TrackedMarkers& found = tracker.track(frame);
    EXPECT_EQ(found.positions, wanted.positions);
    EXPECT_EQ(found.t_us, wanted.t_us);
    EXPECT_EQ(found.found(), static_cast<int>(places.size()));
  };
  expect_same({fixtures::paint_markers({}, places), 1000});
  std::string said;
  for (Eigen::Vector2d& place : places) place.x() += 1.5;
  for (const std::int64_t t_us : kBadTimes_us) {
    said = message_of([&] { tracker.track({fixtures::paint_markers({}, places), t_us}); });
    EXPECT_THAT(said, HasSubstr(fmt::format("time {} us isn't after the last one's, 1000 us", t_us)));
  }
  expect_same({fixtures::paint_markers({}, places), 1001});
  did("gelsight, marker tracker: {}; then both trackers have the same bits", refused(said));
}

TEST(HardCase44, TheTouchReaderRefusesAndKeepsItsReading) {
  MarkedGel gel;
  const TouchCalibration calibration = gel.calibration();
  const cv::Mat pressed = gel.pressed();
  TouchReader reader(calibration);
  TouchReader other(calibration);
  const TouchReading& reading = reader.read({pressed, 1000});
  other.read({pressed, 1000});
  const double force_N = reading.normal_N.value();
  const cv::Mat height = reading.height_mm.clone();
  ASSERT_GT(force_N, 0.0);
  std::string said;
  for (const std::int64_t t_us : kBadTimes_us) {
    said = message_of([&] { reader.read({calibration.background, t_us}); });
    EXPECT_THAT(said, HasSubstr("isn't after the last one's, 1000 us"));
    EXPECT_EQ(reading.normal_N, force_N);
    ASSERT_FALSE(reading.height_mm.empty());
    EXPECT_EQ(cv::norm(reading.height_mm, height, cv::NORM_INF), 0.0);
  }
  const cv::Mat next = gel.pressed();
  const TouchReading& after = reader.read({next, 1001});
  const TouchReading& wanted = other.read({next, 1001});
  EXPECT_EQ(after.normal_N, wanted.normal_N);
  EXPECT_EQ(after.motion_ratio, wanted.motion_ratio);
  EXPECT_EQ(after.shear_N, wanted.shear_N);
  did("gelsight, touch reader: {}; its last reading, {:.4g} N, stays, and the next frame's is the same to the bit",
      refused(said), force_N);
}

TEST(HardCase44, TheExploreTrackerRefusesAndGoesOn) {
  const fixtures::FingertipPainter painter{.noise = 0.6};
  ExploreSettings settings;
  settings.times = chip_pixel_times(1.0 / 1500.0);
  const cv::Mat rest = painter.paint(DotsMotion{}, 10000);
  ExploreTracker tracker(rest, settings);
  ExploreTracker other(rest, settings);
  constexpr std::int64_t kPicture_us = 216000;
  const auto expect_same = [&](double press_mm, std::int64_t t_us) {
    const cv::Mat picture = painter.paint(DotsMotion{fixtures::dilation_of(press_mm), {0.1, 0.0}}, 3);
    const ExploreReading wanted = other.next({picture, t_us});
    const ExploreReading& found = tracker.next({picture, t_us});
    EXPECT_EQ(found.motion, wanted.motion);
    EXPECT_EQ(found.t_us, wanted.t_us);
    EXPECT_EQ(found.mode, wanted.mode);
  };
  expect_same(0.2, 1000 - kPicture_us);
  expect_same(0.4, 1000);
  const ExploreReading before = tracker.last();
  std::string said;
  for (const std::int64_t t_us : {std::int64_t{-5'000'000}, std::int64_t{999}, std::int64_t{1000}}) {
    said = message_of([&] { tracker.next({painter.paint(DotsMotion{}), t_us}); });
    EXPECT_THAT(said, HasSubstr(fmt::format("t = {} us follows one at t = 1000 us; times must increase", t_us)));
    EXPECT_EQ(tracker.last().motion, before.motion);
    EXPECT_EQ(tracker.last().t_us, before.t_us);
  }
  for (const std::int64_t t_us : {kEarliest, kLatest}) {
    EXPECT_THAT(message_of([&] { tracker.next({painter.paint(DotsMotion{}), t_us}); }), HasSubstr("allowed is"));
  }
  expect_same(0.6, 1000 + kPicture_us);
  did("reflex, explore tracker: {}; then both trackers have the same bits", refused(said));
}

TEST(HardCase44, TheReflexLoopKnowsNoClock) {
  ReflexModel model;
  model.tree.nodes.resize(3);
  model.tree.nodes[0] = {ChipFeature::maximum, 37.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.force.coefficients = {-10.0, 0.0, 0.0, 0.0, 1.0 / 1.5};
  ReflexSettings settings;
  settings.stop_above_N = 100.0;
  ReflexLoop with_good_times(model, settings);
  ReflexLoop with_bad_times(model, settings);
  std::int64_t t_us = 0;
  for (const double average : {18.0, 19.0, 18.5, 21.0, 17.0}) {
    ChipStatistics statistics{.maximum = 40, .minimum = 7, .squal = 82, .average = average};
    statistics.t_us = t_us += 667;
    const ReflexDecision wanted = with_good_times.next(statistics);
    statistics.t_us = t_us % 2 == 0 ? kEarliest : 1000 - t_us;
    const ReflexDecision found = with_bad_times.next(statistics);
    EXPECT_EQ(found.force_N, wanted.force_N);
    EXPECT_EQ(found.stop, wanted.stop);
    EXPECT_EQ(found.fault, wanted.fault);
  }
  did("reflex, statistics: decisions count frames and not time, so that any time stamps give the same bits");
}

TEST(HardCase44, EventsOfOneTimeCountAndEarlierOnesAreRefused) {
  EventWindowSettings settings;
  settings.length_us = 10;
  EventWindows windows(settings);
  const std::vector<Event> burst(1000, Event{5, 1, 1, true});  // a thousand in one microsecond
  windows.add(burst);
  const std::vector<Event> backward = {{7, 0, 0, false}, {6, 0, 0, false}, {8, 0, 0, false}};
  const std::string said = message_of([&] { windows.add(backward); });
  EXPECT_THAT(said, HasSubstr("event 1001: its time is 6 us, that of the one before is 7 us"));
  EXPECT_EQ(windows.events(), 1001);
  windows.add(std::vector<Event>{{9, 0, 0, false}});
  windows.end_at(20);
  windows.end_at(3);  // what is over stays over
  ASSERT_EQ(windows.finished().size(), 2U);
  EXPECT_EQ(windows.finished()[0], (EventCounts{1000, 2}));
  EXPECT_EQ(windows.finished()[1], (EventCounts{0, 0}));
  EXPECT_THAT(message_of([&] { windows.add(std::vector<Event>{{19, 0, 0, false}}); }), HasSubstr("go backwards"));
  EXPECT_THAT(message_of([&] { windows.add(std::vector<Event>{{kLatest, 0, 0, false}}); }), HasSubstr("only"));
  EXPECT_THAT(message_of([&] { windows.end_at(kLatest); }), HasSubstr("can't end at"));
  EXPECT_EQ(windows.events(), 1002);
  EventWindowSettings none = settings;
  none.length_us = 0;
  EXPECT_THAT(message_of([&] { const EventWindows empty(none); }), HasSubstr("length_us is 0"));
  did("event windows: 1000 events of one microsecond are 1000; one that is a microsecond early is {}; windows of no "
      "length are {}",
      refused(said), refused(message_of([&] { const EventWindows empty(none); })));
}

TEST(HardCase44, FilesOfEventsKeepEqualTimesAndRefuseEarlierOnes) {
  const test::TemporaryFolder folder;
  const std::vector<Event> equal = {{7, 3, 2, true}, {7, 3, 2, false}, {7, 1, 2, true}, {9, 0, 0, false}};
  std::string said;
  int formats = 0;
  for (const char* name : {"events.txt", "events.h5", "events.raw", "events.aedat4"}) {
    const auto file = folder.path() / name;
    {
      EventWriter writer(file, {16, 16}, "a test");
      writer.append(equal);
      said = message_of([&] { writer.append(std::vector<Event>{{8, 0, 0, true}}); });
      EXPECT_THAT(said, HasSubstr("8 us, before the 9 us")) << name;
      writer.close();
    }
    const std::vector<Event> back = read_events(file, {cv::Size(16, 16), {}}).events;
    ASSERT_EQ(back.size(), equal.size()) << name;
    for (std::size_t i = 0; i < back.size(); ++i) {
      EXPECT_EQ(back[i].t_us - back[0].t_us, equal[i].t_us - equal[0].t_us) << name;
      EXPECT_EQ(back[i].x, equal[i].x) << name;
      EXPECT_EQ(back[i].on, equal[i].on) << name;
    }
    ++formats;
  }
  did("files of events, {} formats: events of one microsecond come back in their order; an earlier one is refused: "
      "\"{}\"",
      formats, said.substr(said.rfind('/') + 1));
}

}  // namespace
}  // namespace touchstone::sensors
