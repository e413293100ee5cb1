// The hard case of estimators, 30: frames that are black, saturated, of one value, or of another sensor's size. What a
// good program does with it stands in script/hard_cases_page.py.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "sensors/beads/bead_tracker.h"
#include "sensors/colour/colour_marker_finder.h"
#include "sensors/heights/height_estimator.h"
#include "sensors/markers/marker_tracker.h"
#include "sensors/markers/touch_reader.h"
#include "sensors/reflex/explore_tracker.h"
#include "sensors/reflex/reflex_loop.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/sensors/beads/rendered_beads.h"
#include "tests/sensors/colour/painted_colour_markers.h"
#include "tests/sensors/heights/painted_gel.h"
#include "tests/sensors/markers/painted_marked_gel.h"
#include "tests/sensors/markers/painted_markers.h"
#include "tests/sensors/reflex/painted_fingertip.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using touchstone::test::did;
using touchstone::test::message_of;
using touchstone::test::refused;
using touchstone::test::Worst;

struct BadLight {
  const char* name;
  int value;  ///< of all pixels, of 255
  FrameLight light;
};
constexpr BadLight kBadLights[] = {
    {"black", 0, FrameLight::kDark}, {"white", 255, FrameLight::kSaturated}, {"constant grey", 120, FrameLight::kFlat}};

cv::Mat even(const cv::Size& size, int type, int value) {
  return {size, type, cv::Scalar::all(value)};
}

TEST(HardCase30, TheBeadTrackerSaysSoAndHoldsItsBeads) {
  fixtures::BeadPainter painter({.noise = 2.0});
  const std::vector<Eigen::Vector2d> rest = fixtures::grid_positions(3, 71.0, {320.0, 240.0});
  BeadTracker tracker({});
  std::int64_t t_us = 0;
  ASSERT_EQ(tracker.track({painter.paint(rest), ++t_us}).found(), 9);
  for (const auto& [name, value, light] : kBadLights) {
    const TrackedBeads& tracked = tracker.track({even({640, 480}, CV_8U, value), ++t_us});
    EXPECT_EQ(tracked.light, light) << name;
    EXPECT_EQ(tracked.found(), 0) << name;
    for (const Eigen::Vector2d& place : tracked.positions) EXPECT_TRUE(place.allFinite()) << name;
    did("vhs, bead tracker: a {} frame is called {}, {} of 9 beads found", name, name_of(tracked.light),
        tracked.found());
  }
  const std::string said = message_of([&] { tracker.track({even({320, 240}, CV_8U, 100), ++t_us}); });
  EXPECT_THAT(said, HasSubstr("320 x 240"));
  did("vhs, bead tracker: a frame of another size is {}", refused(said));
  const TrackedBeads& after = tracker.track({painter.paint(rest), ++t_us});
  Worst away{0.25};  // three times the noise of a bead's place
  for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_LT(away((after.positions[i] - rest[i]).norm()), away.bar);
  did("vhs, bead tracker: in the next good frame {} of 9 beads found, to {}", after.found(), away.text("px"));
  EXPECT_EQ(after.found(), 9);
}

TEST(HardCase30, TheHeightEstimatorSaysSo) {
  fixtures::GelPainter painter(kGelWidth, kGelHeight, kGelScale_mm, {});
  HeightEstimator estimator(small_height_model(painter));
  for (const auto& [name, value, light] : kBadLights) {
    const HeightResult& result = estimator.estimate(even({kGelWidth, kGelHeight}, CV_8UC3, value));
    EXPECT_FALSE(result.trusted()) << name;
    EXPECT_EQ(result.dark, light == FrameLight::kDark) << name;
    EXPECT_EQ(result.overexposed, light == FrameLight::kSaturated) << name;
    EXPECT_TRUE(result.flat) << name;
    EXPECT_TRUE(cv::checkRange(result.height_mm)) << name;
    did("gelsight, height estimator: a {} frame is {}{}", name, result.trusted() ? "trusted" : "not trusted",
        result.dark          ? ", as dark"
        : result.overexposed ? ", as overexposed"
        : result.flat        ? ", as flat"
                             : "");
  }
  const std::string said = message_of([&] { estimator.estimate(even({kGelWidth, 100}, CV_8UC3, 90)); });
  EXPECT_THAT(said, HasSubstr("240 x 100"));
  did("gelsight, height estimator: a frame of another size is {}", refused(said));
  EXPECT_TRUE(estimator.estimate(painter.rest()).trusted());
}

TEST(HardCase30, TheMarkerTrackerSaysSoAndHoldsItsMarkers) {
  const std::vector<Eigen::Vector2d> rest = fixtures::marker_grid();
  const cv::Mat good = fixtures::paint_markers({}, rest);
  MarkerTracker tracker({});
  std::int64_t t_us = 0;
  const TrackedMarkers before = tracker.track({good, ++t_us});
  for (const auto& [name, value, light] : kBadLights) {
    const TrackedMarkers& tracked = tracker.track({even(good.size(), CV_8UC3, value), ++t_us});
    EXPECT_EQ(tracked.light, light) << name;
    EXPECT_EQ(tracked.found(), 0) << name;
    EXPECT_EQ(tracked.positions, before.positions) << name;
    did("gelsight, marker tracker: a {} frame is called {}, {} of {} markers found", name, name_of(tracked.light),
        tracked.found(), rest.size());
  }
  const std::string said = message_of([&] { tracker.track({even({640, 480}, CV_8UC3, 90), ++t_us}); });
  EXPECT_THAT(said, HasSubstr("640 x 480"));
  did("gelsight, marker tracker: a frame of another size is {}", refused(said));
  const int found = tracker.track({good, ++t_us}).found();
  EXPECT_EQ(found, static_cast<int>(rest.size()));
  did("gelsight, marker tracker: in the next good frame {} of {} markers found", found, rest.size());
}

TEST(HardCase30, TheTouchReaderSaysSoAndTakesNoSlipFromIt) {
  MarkedGel gel;
  TouchReader reader(gel.calibration());
  std::int64_t t_us = 0;
  const double force_N = reader.read({gel.pressed(), ++t_us}).normal_N.value();
  for (const auto& [name, value, light] : kBadLights) {
    const TouchReading& reading = reader.read({even({kGelWidth, kGelHeight}, CV_8UC3, value), ++t_us});
    EXPECT_EQ(reading.light, light) << name;
    EXPECT_EQ(reading.markers_found, 0) << name;
    EXPECT_FALSE(reading.rule_slip || reading.rim.slips()) << name;
    did("gelsight, touch reader: a {} frame is called {}, {} of {} markers found, no slip", name,
        name_of(reading.light), reading.markers_found, gel.markers.size());
  }
  const TouchReading& after = reader.read({gel.pressed(), ++t_us});
  Worst away{0.01};
  EXPECT_EQ(after.light, FrameLight::kNormal);
  EXPECT_LT(away(std::abs(*after.normal_N / force_N - 1.0)), away.bar);
  ASSERT_TRUE(after.motion_ratio);
  EXPECT_LT(*after.motion_ratio, 0.1);  // nothing moved since the last frame with light
  EXPECT_FALSE(after.rule_slip || after.rim.slips());
  did("gelsight, touch reader: the next good frame's force differs from that of the last one by {}, its moving share "
      "is {:.2g}",
      away.text("relative"), *after.motion_ratio);
}

TEST(HardCase30, TheColourMarkerFinderSaysSo) {
  const fixtures::ColourPicture picture = fixtures::small_colour_picture(16.0);
  const cv::Mat good = fixtures::paint_colour_markers(picture);
  const auto whole = [](const ColourMarkerReading& reading) {
    return std::count_if(reading.markers.begin(), reading.markers.end(),
                         [](const ColourMarker& marker) { return marker.flaw == MarkerFlaw::kNone; });
  };
  ColourMarkerFinder finder({.grid = {picture.columns, picture.rows}});
  finder.find_rest(good);
  for (const auto& [name, value, light] : kBadLights) {
    const ColourMarkerReading& reading = finder.find(even(good.size(), CV_8UC3, value));
    EXPECT_EQ(reading.light, light) << name;
    EXPECT_EQ(whole(reading), 0) << name;
    did("chroma, colour markers: a {} frame is called {}, {} of {} markers read", name, name_of(reading.light),
        whole(reading), picture.count());
  }
  const std::string said = message_of([&] { finder.find(good(cv::Rect(0, 0, 150, 100))); });
  EXPECT_THAT(said, HasSubstr("150 x 100"));
  did("chroma, colour markers: a frame of another size is {}", refused(said));
  EXPECT_EQ(whole(finder.find(good)), static_cast<std::ptrdiff_t>(picture.count()));
}

TEST(HardCase30, TheExploreTrackerSaysSoAndHoldsItsMotion) {
  const fixtures::FingertipPainter painter{.noise = 0.6};
  ExploreTracker tracker(painter.paint(DotsMotion{}, 10000), {});
  const DotsMotion pressed{1.05, {0.2, 0.1}};
  std::int64_t t_us = 0;
  const DotsMotion before = tracker.next({painter.paint(pressed), ++t_us}).motion;
  const struct {
    const char* name;
    cv::Mat picture;
    PictureFault fault;
  } cases[] = {{"black", even({18, 18}, CV_8UC1, 0), PictureFault::dark},
               {"white", even({18, 18}, CV_8UC1, 63), PictureFault::saturated},
               {"constant grey", even({18, 18}, CV_8UC1, 30), PictureFault::flat},
               {"foreign-sized", painter.paint(DotsMotion{})(cv::Rect(0, 0, 17, 18)), PictureFault::foreign}};
  for (const auto& [name, picture, fault] : cases) {
    const ExploreReading& reading = tracker.next({picture, ++t_us});
    EXPECT_EQ(reading.fault, fault) << name;
    EXPECT_EQ(reading.mode, ExploreMode::held) << name;
    EXPECT_EQ(reading.motion, before) << name;
    did("reflex, explore tracker: a {} picture is called {}, its motion {}", name, name_of(reading.fault),
        name_of(reading.mode));
  }
  EXPECT_EQ(tracker.next({painter.paint(pressed, 5), ++t_us}).fault, PictureFault::none);
}

TEST(HardCase30, TheReflexLoopSaysSoHoldsItsForceAndStops) {
  ReflexModel model;
  model.tree.nodes.resize(3);  // a force is there where MAX > 37
  model.tree.nodes[0] = {ChipFeature::maximum, 37.0, 1, 2, false};
  model.tree.nodes[1].force_present = true;
  model.force.coefficients = {-10.0, 0.0, 0.0, 0.0, 1.0 / 1.5};
  const ChipStatistics pressed{.maximum = 40, .minimum = 7, .squal = 82, .average = 18.0};
  const struct {
    const char* name;
    ChipStatistics statistics;
    ChipFault fault;
  } cases[] = {{"black", {}, ChipFault::dark},
               {"white", {.maximum = 63, .minimum = 63, .squal = 0, .average = 63.0}, ChipFault::saturated},
               {"constant grey", {.maximum = 30, .minimum = 30, .squal = 0, .average = 30.0}, ChipFault::flat}};
  for (const auto& [name, statistics, fault] : cases) {
    ReflexSettings settings;
    settings.stop_above_N = 100.0;
    ReflexLoop loop(model, settings);
    const double before = loop.next(pressed).force_N;
    ReflexDecision decision;
    for (int frame = 1; frame <= settings.blind_frames; ++frame) {
      decision = loop.next(statistics);
      EXPECT_EQ(decision.fault, fault) << name;
      EXPECT_EQ(decision.force_N, before) << name;
      EXPECT_EQ(decision.stop, frame == settings.blind_frames) << name;
    }
    did("reflex, statistics: {} frames are called {}; the actuator {} after {} of them", name, name_of(decision.fault),
        decision.stop ? "stops" : "goes on", settings.blind_frames);
  }
}

}  // namespace
}  // namespace touchstone::sensors
