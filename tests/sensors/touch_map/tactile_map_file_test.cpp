#include "sensors/touch_map/tactile_map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "tests/sensors/touch_map/drawn_relief.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;

TactileMap small_map() {
  fixtures::Camera small;
  small.columns = 120, small.rows = 100;
  TactileMap map;
  map.add(fixtures::touch_of(fixtures::strewn_relief(1), {}, 1, small));
  return map;
}

std::string error_of(const std::string& bytes) {
  try {
    tactile_map_from_bytes(bytes, "a.map");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

TEST(TactileMapFile, AMapComesBackAsItWas) {
  const touchstone::test::TemporaryFolder folder;
  const TactileMap map = small_map();
  save(map.data(), folder.path() / "a.map");
  const TactileMapData back = load_tactile_map(folder.path() / "a.map");
  EXPECT_EQ(back.touches, 1);
  EXPECT_EQ(back.frame.mm_per_px, map.data().frame.mm_per_px);
  EXPECT_EQ(back.frame.origin_px, map.data().frame.origin_px);
  EXPECT_EQ(cv::norm(back.height_mm, map.data().height_mm, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(back.weight, map.data().weight, cv::NORM_INF), 0.0);
  EXPECT_EQ(to_bytes(back), to_bytes(map.data()));
}

TEST(TactileMapFile, ALoadedMapLocalisesAsTheOldOne) {
  const Eigen::Vector2d place(0.4, -0.3);
  const TouchImage touch = fixtures::touch_of(fixtures::strewn_relief(1), {0.5, place}, 2);
  fixtures::Camera camera;
  TactileMap map;
  map.add(fixtures::touch_of(fixtures::strewn_relief(1), {}, 1, camera));
  const TactileMap back(tactile_map_from_bytes(to_bytes(map.data()), "a.map"));
  const Registration a = map.localise(touch), b = back.localise(touch);
  ASSERT_TRUE(b.localised());
  EXPECT_EQ(a.to_from_from.angle, b.to_from_from.angle);
  EXPECT_EQ(a.to_from_from.translation, b.to_from_from.translation);
}

TEST(TactileMapFile, WhatIsNoMapIsRefusedWithItsReason) {
  const std::string good = to_bytes(small_map().data());
  EXPECT_EQ(error_of(good), "");
  EXPECT_THAT(error_of(""), HasSubstr("a.map:1: isn't a tactile map"));
  EXPECT_THAT(error_of("{}"), HasSubstr("isn't a tactile map"));
  EXPECT_THAT(error_of(replaced(good, "tactile_map 1", "tactile_map 2")), HasSubstr("has version 2"));
  EXPECT_THAT(error_of("touchstone.tactile_map 1\n{"), HasSubstr("cut short"));
  EXPECT_THAT(error_of("touchstone.tactile_map 1\n{\n"), HasSubstr("isn't a JSON map"));
  EXPECT_THAT(error_of(replaced(good, "\"rows\":100", "\"rows\":101")), HasSubstr("120 x 101 need"));
  EXPECT_THAT(error_of(replaced(good, "\"rows\":100", "\"rows\":-1")), HasSubstr("rows is -1"));
  EXPECT_THAT(error_of(replaced(good, "\"rows\":100", "\"rows\":1e9")), HasSubstr("rows is"));
  EXPECT_THAT(error_of(replaced(good, "\"touches\":1", "\"touches\":0")), HasSubstr("touches is 0"));
  EXPECT_THAT(error_of(replaced(good, "\"touches\"", "\"tuches\"")), HasSubstr("'tuches' isn't known"));
  EXPECT_THAT(error_of(replaced(good, "\"mm_per_px\":0.05", "\"mm_per_px\":0.0")), HasSubstr("0 mm a pixel"));
  EXPECT_THAT(error_of(replaced(good, "\"mm_per_px\":0.05", "\"mm_per_px\":\"\"")), HasSubstr("a number is needed"));
  EXPECT_THAT(error_of(good.substr(0, good.size() - 1)), HasSubstr("bytes of pixels"));
  EXPECT_THAT(error_of(good + "x"), HasSubstr("bytes of pixels"));
  std::string damaged = good;
  damaged[damaged.size() - 100] ^= 1;
  EXPECT_THAT(error_of(damaged), HasSubstr("checksum"));
}

TEST(TactileMapFile, DataThatCannotBeAreRefused) {
  TactileMapData data = small_map().data();
  data.height_mm.at<float>(3, 2) = std::numeric_limits<float>::infinity();
  EXPECT_THROW(to_bytes(data), Error);
  EXPECT_THROW(TactileMap{data}, Error);
  data = small_map().data();
  data.weight.at<float>(3, 2) = -1.0F;
  EXPECT_THROW(to_bytes(data), Error);
  data = small_map().data();
  data.weight = data.weight.rowRange(0, 10);
  EXPECT_THROW(to_bytes(data), Error);
}

}  // namespace
}  // namespace touchstone::sensors
