#include "lab/dvs_grasps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <set>

#include "core/error.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

/// Set up once: some ten seconds.
const DvsGraspBench& bench() {
  static const test::TemporaryFolder cache;
  static const DvsGraspBench made(kScenes, cache.path());
  return made;
}

TEST(DvsGrasps, AreTheTextsFortyEightAndWithinTheirRanges) {
  int grasps = 0;
  double last_modulus = 0.0;
  for (int material = 0; material < 4; ++material) {
    grasps += dvs_materials()[static_cast<std::size_t>(material)].grasps;
    const sim::ObjectSpec piece =
        sim::read_object(kScenes / dvs_materials()[static_cast<std::size_t>(material)].object_file);
    EXPECT_NEAR(piece.shape.across_flats_mm * 2 / std::sqrt(3.0), 7.5, 0.01) << "text V.A: 0.75 x 0.65 cm";
    EXPECT_EQ(piece.shape.length_mm, 35.5);
    const double modulus = piece.elastic ? piece.elastic->youngs_modulus_MPa : INFINITY;
    EXPECT_GT(modulus, last_modulus) << "foam, rubber, silicone, steel";
    last_modulus = modulus;
    std::set<double> forces;
    for (std::uint64_t index = 0; index < 200; ++index) {
      const DvsGraspParameters p = draw_dvs_grasp(material, piece, 7, index);
      EXPECT_GE(p.motion.target_force_N, 0.3);
      EXPECT_LE(p.motion.target_force_N, 3.5);
      EXPECT_GT(p.friction, std::tan(15 * 3.14159265358979 / 180)) << "held without sliding";
      EXPECT_LE(std::abs(p.pose.pitch_deg), 0.15 + 1e-12);
      EXPECT_LE(35.5 / 2 + std::abs(p.pose.place_mm.x()), 20.0);
      EXPECT_EQ(p.youngs_modulus_MPa > 0.0, piece.elastic.has_value());
      forces.insert(p.motion.target_force_N);
    }
    EXPECT_EQ(forces.size(), 200u);
  }
  EXPECT_EQ(grasps, 48);
  const sim::ObjectSpec foam = sim::read_object(kScenes / dvs_materials()[0].object_file);
  EXPECT_EQ(draw_dvs_grasp(0, foam, 1, 5).motion.target_force_N, draw_dvs_grasp(0, foam, 1, 5).motion.target_force_N);
  EXPECT_NE(draw_dvs_grasp(0, foam, 1, 5).motion.target_force_N, draw_dvs_grasp(0, foam, 2, 5).motion.target_force_N);
  EXPECT_THROW(draw_dvs_grasp(4, foam, 1, 5), Error);
}

TEST(DvsGrasps, SofterPiecesTakeLongerAndCoverMoreAtTheSameForce) {
  double last_cover = 1e9;
  double last_time = 1e9;
  for (const int material : {0, 1, 3}) {
    DvsGraspParameters p = draw_dvs_grasp(material, bench().piece(material), 3, 0);
    p.pose = {};
    p.pose.pitch_deg = 0.1;
    p.rms_slope = 0.08;
    p.motion.target_force_N = 2.0;
    p.motion.clearance_mm = 1.0;
    if (material == 0) p.youngs_modulus_MPa = 0.15;
    const DvsGrasp grasp = bench().play(p);
    const sim::FaceMap map = grasp.face->map(grasp.face->at_normal_force(1.0));
    const double cover = cv::sum(map.coverage)[0] * grasp.face->grid().pixel_area();
    EXPECT_LT(cover, 0.95 * last_cover);
    last_cover = cover;
    const double time = grasp.run.release_s - p.motion.hold_s - grasp.run.first_touch_s;
    EXPECT_LT(time, last_time);
    last_time = time;
    EXPECT_GE(grasp.readings.size(), 144u) << "the text's 144 windows (fig. 8)";
    EXPECT_LT(grasp.face->states().back().approach_mm, 2.0);
  }
}

TEST(DvsGrasps, TheSameParametersGiveTheSameGrasp) {
  const DvsGraspParameters p = bench().draw(11).back();
  EXPECT_EQ(p.material, 3);
  const DvsGrasp one = bench().play(p);
  const DvsGrasp two = bench().play(p);
  ASSERT_EQ(one.readings.size(), two.readings.size());
  for (std::size_t k = 0; k < one.readings.size(); ++k)
    EXPECT_EQ(one.readings[k].measured_N, two.readings[k].measured_N);
  const sim::FaceMap a = one.face->map(one.face->at_travel(0.01));
  const sim::FaceMap b = two.face->map(two.face->at_travel(0.01));
  EXPECT_EQ(std::memcmp(a.coverage.data, b.coverage.data, a.coverage.total() * a.coverage.elemSize()), 0);
}

TEST(DvsGrasps, WrongMaterialsAndMissingScenesAreRefused) {
  DvsGraspParameters p = bench().draw(1).front();
  p.material = 4;
  EXPECT_THROW(bench().play(p), Error);
  p.material = 0;
  p.youngs_modulus_MPa = 0.0;
  try {
    bench().play(p);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("Young's modulus is 0"));
  }
  const test::TemporaryFolder empty;
  EXPECT_THROW(DvsGraspBench(empty.path(), empty.path()), Error);
}

}  // namespace
}  // namespace touchstone::lab
