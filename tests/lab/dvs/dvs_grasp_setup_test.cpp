// Whole grasps of the device and the four pieces.

#include "lab/dvs/dvs_grasps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

/// Set up once: some ten seconds.
const DvsGraspSetup& setup() {
  static const test::TemporaryFolder cache;
  static const DvsGraspSetup made(kScenes, cache.path());
  return made;
}

TEST(DvsGrasps, SofterPiecesTakeLongerAndCoverMoreAtTheSameForce) {
  double last_cover = 1e9;
  double last_time = 1e9;
  double last_travel = 1e9;
  for (const int material : {0, 1, 3}) {
    DvsGraspParameters p = draw_dvs_grasp(material, setup().piece(material), 3, 0);
    p.pose = {};
    p.pose.pitch_deg = 0.1;
    p.rms_slope = 0.08;
    p.motion.target_force_N = 2.0;
    p.motion.clearance_mm = 1.0;
    if (material == 0) p.youngs_modulus_MPa = 0.15;
    const DvsGrasp grasp = setup().play(p);
    const sim::FaceMap map = grasp.face->map(grasp.face->at_normal_force(1.0));
    const double cover = cv::sum(map.coverage)[0] * grasp.face->grid().pixel_area();
    EXPECT_LT(cover, 0.95 * last_cover);
    last_cover = cover;
    const double time = grasp.run.release_s - p.motion.hold_s - grasp.run.first_touch_s;
    EXPECT_LE(time, last_time);  // in whole steps of the servo
    last_time = time;
    const double travel = grasp.face->at_normal_force(1.9).travel_mm;
    EXPECT_LT(travel, 0.9 * last_travel);
    last_travel = travel;
    EXPECT_GE(grasp.readings.size(), 144u) << "144 windows in [Naeini2020, fig. 8]";
    EXPECT_LT(grasp.face->states().back().approach_mm, 2.0);
  }
}

TEST(DvsGrasps, TheSameParametersGiveTheSameGrasp) {
  const DvsGraspParameters p = setup().draw(11).back();
  EXPECT_EQ(p.material, 3);
  const DvsGrasp one = setup().play(p);
  const DvsGrasp two = setup().play(p);
  ASSERT_EQ(one.readings.size(), two.readings.size());
  for (std::size_t k = 0; k < one.readings.size(); ++k)
    EXPECT_EQ(one.readings[k].measured_N, two.readings[k].measured_N);
  const sim::FaceMap a = one.face->map(one.face->at_travel(0.01));
  const sim::FaceMap b = two.face->map(two.face->at_travel(0.01));
  EXPECT_EQ(std::memcmp(a.coverage.data, b.coverage.data, a.coverage.total() * a.coverage.elemSize()), 0);
}

TEST(DvsGrasps, WrongMaterialsAndMissingScenesAreRefused) {
  DvsGraspParameters p = setup().draw(1).front();
  p.material = 4;
  EXPECT_THROW(setup().play(p), Error);
  p.material = 0;
  p.youngs_modulus_MPa = 0.0;
  try {
    setup().play(p);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("Young's modulus is 0"));
  }
  const test::TemporaryFolder empty;
  EXPECT_THROW(DvsGraspSetup(empty.path(), empty.path()), Error);
}

}  // namespace
}  // namespace touchstone::lab
