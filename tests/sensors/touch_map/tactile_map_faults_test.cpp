// What must not be localised: the answer is a reason, never a wrong pose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "sensors/touch_map/tactile_map.h"
#include "tests/sensors/touch_map/drawn_relief.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using fixtures::Surface;
using fixtures::touch_of;
using ::testing::HasSubstr;
using touchstone::test::message_of;

TactileMap map_of(const Surface& surface) {
  TactileMap map;
  map.add(touch_of(surface, {}, 1));
  return map;
}

TEST(TactileMapFaults, NoContactIsNotLocalisedAndMakesNoRoot) {
  const Surface nothing = [](const Eigen::Vector2d&) { return 0.0; };
  EXPECT_EQ(map_of(fixtures::strewn_relief(1)).localise(touch_of(nothing, {}, 2)).outcome, Outcome::no_contact);
  TactileMap map;
  EXPECT_EQ(map.add(touch_of(nothing, {}, 2)).outcome, Outcome::no_contact);
  EXPECT_TRUE(map.empty());
}

TEST(TactileMapFaults, APlaneIsNotLocalised) {
  const Surface plane = [](const Eigen::Vector2d& p) { return 0.3 + 0.01 * p.x(); };
  EXPECT_FALSE(map_of(fixtures::strewn_relief(1)).localise(touch_of(plane, {}, 2)).localised());
  EXPECT_FALSE(map_of(plane).localise(touch_of(plane, {}, 2)).localised());
  const Surface still = [](const Eigen::Vector2d&) { return 0.3; };
  fixtures::Camera noiseless;
  noiseless.noise_mm = 0.0;
  EXPECT_EQ(map_of(plane).localise(touch_of(still, {}, 2, noiseless)).outcome, Outcome::no_texture);
}

TEST(TactileMapFaults, AnEdgeIsNotLocalised) {
  const Surface edge = [](const Eigen::Vector2d& p) { return 0.1 + 0.1 / (1.0 + std::exp(-10.0 * p.x())); };
  const TactileMap map = map_of(edge);
  for (int i = 0; i < 5; ++i) {
    EXPECT_FALSE(map.localise(touch_of(edge, {0.0, {0.0, 0.7 * i}}, static_cast<std::uint64_t>(i + 2))).localised());
  }
}

TEST(TactileMapFaults, AGratingIsNotLocalised) {
  const Surface lines = [](const Eigen::Vector2d& p) { return 0.1 + 0.03 * std::cos(2.0 * kPi * p.x() / 0.8); };
  const TactileMap map = map_of(lines);
  for (int i = 0; i < 6; ++i) {
    const PlanarPose pose{0.3 * i, {0.31 * i, 0.2}};
    EXPECT_FALSE(map.localise(touch_of(lines, pose, static_cast<std::uint64_t>(i + 2))).localised());
  }
}

TEST(TactileMapFaults, AGridIsNotLocalised) {
  const Surface studs = [](const Eigen::Vector2d& p) {
    return 0.1 + 0.03 * std::cos(2.0 * kPi * p.x() / 1.2) * std::cos(2.0 * kPi * p.y() / 1.2);
  };
  const TactileMap map = map_of(studs);
  for (int i = 0; i < 6; ++i) {
    const PlanarPose pose{0.3 * i, {0.31 * i, 0.2}};
    const Registration found = map.localise(touch_of(studs, pose, static_cast<std::uint64_t>(i + 2)));
    EXPECT_FALSE(found.localised()) << "inliers " << found.inliers << " runner up " << found.runner_up;
  }
}

TEST(TactileMapFaults, AnotherObjectIsNotLocalised) {
  const TactileMap map = map_of(fixtures::strewn_relief(1));
  for (std::uint64_t seed = 2; seed < 8; ++seed) {
    EXPECT_FALSE(map.localise(touch_of(fixtures::strewn_relief(seed), {}, seed)).localised());
  }
}

TEST(TactileMapFaults, AMirroredObjectIsNotLocalised) {
  const Surface relief = fixtures::strewn_relief(1);
  const Surface mirrored = [&](const Eigen::Vector2d& p) { return relief({-p.x(), p.y()}); };
  EXPECT_FALSE(map_of(relief).localise(touch_of(mirrored, {}, 2)).localised());
}

TEST(TactileMapFaults, ARefusedTouchLeavesTheMapAsItWas) {
  TactileMap map = map_of(fixtures::strewn_relief(1));
  const cv::Mat before = map.data().height_mm.clone();
  EXPECT_FALSE(map.add(touch_of(fixtures::strewn_relief(2), {}, 2)).localised());
  EXPECT_EQ(map.data().touches, 1);
  EXPECT_EQ(cv::norm(before, map.data().height_mm, cv::NORM_INF), 0.0);
}

TEST(TactileMapFaults, BadTouchesAreNamed) {
  TactileMap map = map_of(fixtures::strewn_relief(1));
  TouchImage touch = touch_of(fixtures::strewn_relief(1), {}, 1);
  touch.height_mm.at<float>(7, 11) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message_of([&] { map.localise(touch); }), HasSubstr("pixel (11, 7) is nan"));
  EXPECT_THAT(message_of([&] { map.add(touch); }), HasSubstr("pixel (11, 7) is nan"));

  touch = touch_of(fixtures::strewn_relief(1), {}, 1);
  touch.contact = touch.contact.rowRange(0, 100);
  EXPECT_THAT(message_of([&] { map.localise(touch); }), HasSubstr("320 x 100"));
  touch = touch_of(fixtures::strewn_relief(1), {}, 1);
  touch.height_mm.convertTo(touch.height_mm, CV_64F);
  EXPECT_THAT(message_of([&] { map.localise(touch); }), HasSubstr("CV_32FC1"));
  EXPECT_THAT(message_of([&] { map.localise({}); }), HasSubstr("no heights"));
  touch = touch_of(fixtures::strewn_relief(1), {}, 1);
  touch.mm_per_px = 0.0;
  EXPECT_THAT(message_of([&] { map.localise(touch); }), HasSubstr("0 mm wide"));
  touch.mm_per_px = 0.06;
  EXPECT_THAT(message_of([&] { map.localise(touch); }), HasSubstr("0.06 mm a pixel, the map 0.05"));
}

TEST(TactileMapFaults, AnEmptyMapLocalisesNothing) {
  EXPECT_THAT(message_of([&] { TactileMap().localise(touch_of(fixtures::strewn_relief(1), {}, 1)); }),
              HasSubstr("empty"));
}

}  // namespace
}  // namespace touchstone::sensors
