#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "core/units.h"
#include "sim/scene/object.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

fem::ReliefMap shipped(const std::string& name) {
  const std::filesystem::path objects = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/objects";
  return relief_map(*read_object(objects / (name + ".yaml")).relief);
}

std::string error_of(const std::string& relief) {
  try {
    parse_yaml<ObjectSpec>("name: a\nshape: {type: box, size_mm: [12, 12, 4.5]}\nrelief: " + relief + "\n", "o.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(CoinRelief, HasItsRimAllRoundAndNothingBeyond) {
  for (const auto& [name, radius, rim] :
       {std::tuple("coin-penny", 9.525, 0.15), std::tuple("coin-quarter", 12.13, 0.17)}) {
    const fem::ReliefMap map = shipped(name);
    for (int i = 0; i < 36; ++i) {
      const Eigen::Vector2d direction(std::cos(i * kPi / 18), std::sin(i * kPi / 18));
      const Eigen::Vector2d crest = (radius - 0.4) * direction, outside = (radius + 0.1) * direction;
      EXPECT_NEAR(map.at(crest.x(), crest.y()), rim, 0.02 * rim) << name;
      EXPECT_EQ(map.at(outside.x(), outside.y()), 0.0) << name;
    }
    EXPECT_LE(map.highest(), rim + 1e-6);
  }
}

/// Between two placements of one coin nothing but the true one looks alike: that is what makes it fit for a map.
TEST(CoinRelief, IsUnlikeItselfTurned) {
  const fem::ReliefMap map = shipped("coin-penny");
  for (int degrees = 10; degrees < 360; degrees += 10) {
    const double c = std::cos(degrees * kRadiansPerDegree), s = std::sin(degrees * kRadiansPerDegree);
    double squares = 0.0, differences = 0.0;
    for (double x = -6.0; x <= 6.0; x += 0.1) {
      for (double y = -6.0; y <= 6.0; y += 0.1) {
        const double here = map.at(x, y), turned = map.at(c * x - s * y, s * x + c * y);
        squares += here * here;
        differences += (here - turned) * (here - turned);
      }
    }
    EXPECT_GT(differences, 0.05 * squares) << degrees;
  }
}

TEST(CoinRelief, ASeedIsACoin) {
  const CoinRelief one{19.05, 150, 150, 1}, other{19.05, 150, 150, 2};
  double same = 0.0, different = 0.0;
  const fem::ReliefMap a = relief_map(one), b = relief_map(one), c = relief_map(other);
  for (double x = -7.0; x <= 7.0; x += 0.5) {
    for (double y = -7.0; y <= 7.0; y += 0.5) {
      same = std::max(same, std::abs(a.at(x, y) - b.at(x, y)));
      different = std::max(different, std::abs(a.at(x, y) - c.at(x, y)));
    }
  }
  EXPECT_EQ(same, 0.0);
  EXPECT_GT(different, 0.05);
}

TEST(PlugRelief, HasWindowsSeamAndBends) {
  const fem::ReliefMap map = shipped("usb-a-plug");
  const double window_y = -6.0 + 5.16 + 1.125;
  EXPECT_NEAR(map.at(3.0, 3.0), 0.3, 1e-6) << "the face";
  EXPECT_NEAR(map.at(2.85, window_y), 0.0, 1e-6) << "a window";
  EXPECT_NEAR(map.at(-2.85, window_y), 0.0, 1e-6) << "the other";
  EXPECT_NEAR(map.at(2.85, window_y + 1.3), 0.3, 1e-6) << "beyond its edge";
  EXPECT_LT(map.at(0.0, -4.0), 0.05) << "the seam";
  EXPECT_NEAR(map.at(0.2, -4.0), 0.3, 1e-6) << "beside it";
  EXPECT_LT(map.at(5.99, 0.0), 0.05) << "the bend at its side";
  EXPECT_LT(map.at(3.0, -5.99), 0.05) << "the mouth's rounding";
  EXPECT_NEAR(map.at(3.0, 5.95), 0.3, 1e-6) << "the shell runs on into the overmould";
}

TEST(PlugRelief, WindowsThatDoNotFitAreRefused) {
  const auto with = [](const std::string& windows) {
    return error_of("{type: plug, width_mm: 12, length_mm: 12, sheet_um: 300, edge_radius_mm: 0.4, " + windows + "}");
  };
  EXPECT_EQ(with("window_mm: [2.5, 2.25], window_apart_mm: 5.7, window_from_mouth_mm: 5"), "");
  EXPECT_THAT(with("window_mm: [2.5, 2.25], window_apart_mm: 2, window_from_mouth_mm: 5"),
              HasSubstr("window_apart_mm"));
  EXPECT_THAT(with("window_mm: [2.5, 2.25], window_apart_mm: 5.7, window_from_mouth_mm: 11"),
              HasSubstr("window_from_mouth_mm"));
  EXPECT_THAT(error_of("{type: coin, diameter_mm: 2, rim_um: 100, art_um: 100, seed: 1}"), HasSubstr("diameter_mm"));
}

}  // namespace
}  // namespace touchstone::sim
