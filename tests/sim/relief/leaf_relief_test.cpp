#include "sim/relief/leaf_relief.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

LeafRelief leaf() {
  LeafRelief leaf;
  leaf.size_mm = {60, 40};
  leaf.midrib_height_um = 500;
  leaf.midrib_width_mm = 1.2;
  leaf.vein_height_um = 200;
  leaf.vein_width_mm = 0.5;
  leaf.vein_pitch_mm = 5;
  return leaf;
}

TEST(LeafRelief, TheMidribRunsAlongX) {
  const fem::ReliefMap map = relief_map(leaf());
  for (double x = -29.0; x < 29.0; x += 1.7) {
    EXPECT_NEAR(map.at(x, 0.0), 0.5, 0.01);
    EXPECT_NEAR(map.at(x, 0.3), 0.25, 0.01);  // at half the height of its side, where no side vein is higher
  }
  EXPECT_NEAR(map.highest(), 0.5, 0.01);
}

TEST(LeafRelief, SideVeinsLeaveInPairsAtTheirAngle) {
  const LeafRelief spec = leaf();
  const fem::ReliefMap map = relief_map(spec);
  const double cotangent = 1.0 / std::tan(spec.vein_angle_deg * kRadiansPerDegree);
  for (const double aside : {3.0, 8.0, 15.0}) {
    for (const double side : {-1.0, 1.0}) {
      const double thinned = 0.2 * (1.0 - aside / 20.0);
      EXPECT_NEAR(map.at(5.0 + aside * cotangent, side * aside), thinned, 0.1 * thinned);
      EXPECT_NEAR(map.at(2.5 + aside * cotangent, side * aside), 0.0, 1e-12);  // midway to the next
    }
  }
}

TEST(LeafRelief, NothingIsRaisedBeyondIt) {
  const fem::ReliefMap map = relief_map(leaf());
  EXPECT_EQ(map.at(31.0, 0.0), 0.0);
  EXPECT_EQ(map.at(0.0, 21.0), 0.0);
}

TEST(LeafRelief, ItsFinestDetailIsItsNarrowestVein) {
  EXPECT_EQ(finest_detail(leaf()), 0.5);
}

}  // namespace
}  // namespace touchstone::sim
