// What differs from grasp to grasp.

#include "lab/dvs/dvs_grasps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/error.h"

namespace touchstone::lab {
namespace {

const std::filesystem::path kScenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";

TEST(DvsGrasps, AreTheTextsFortyEightAndWithinTheirRanges) {
  int grasps = 0;
  double last_modulus = 0.0;
  for (int material = 0; material < 4; ++material) {
    grasps += dvs_materials()[static_cast<std::size_t>(material)].grasps;
    const sim::ObjectSpec piece =
        sim::read_object(kScenes / dvs_materials()[static_cast<std::size_t>(material)].object_file);
    EXPECT_NEAR(piece.shape.across_flats_mm * 2 / std::sqrt(3.0), 7.5, 0.01)
        << "[Naeini2020, sec. V.A]: 0.75 x 0.65 cm";
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
  EXPECT_THROW(draw_dvs_grasp(0, foam, 1, 5, {.force = 1.5}), Error);
  EXPECT_THROW(draw_dvs_grasp(0, foam, 1, 5, {.setup = std::nan("")}), Error);
}

// Without a spread all are the middle of what is drawn, but for the pieces' own moduli and faces.
TEST(DvsGrasps, SpreadSaysHowUnlikeTheyAre) {
  const sim::ObjectSpec foam = sim::read_object(kScenes / dvs_materials()[0].object_file);
  for (std::uint64_t index = 0; index < 20; ++index) {
    const DvsGraspParameters alike = draw_dvs_grasp(0, foam, 3, index, {.force = 0.0, .pose = 0.0, .setup = 0.0});
    EXPECT_DOUBLE_EQ(alike.motion.target_force_N, 1.9);
    EXPECT_DOUBLE_EQ(alike.motion.closing_mm_s, 16.5);
    EXPECT_DOUBLE_EQ(alike.motion.clearance_mm, 1.0);
    EXPECT_DOUBLE_EQ(alike.light_level, 1.025);
    EXPECT_EQ(alike.pose.yaw_deg, 0.0);
    const DvsGraspParameters all = draw_dvs_grasp(0, foam, 3, index, {.setup = 1.0});
    EXPECT_EQ(all.friction, alike.friction);
    EXPECT_EQ(all.youngs_modulus_MPa, alike.youngs_modulus_MPa);
    const DvsGraspParameters usual = draw_dvs_grasp(0, foam, 3, index);
    EXPECT_NEAR(usual.light_level - 1.025, 0.1 * (all.light_level - 1.025), 1e-12);
    EXPECT_EQ(usual.motion.target_force_N, all.motion.target_force_N);
  }
}

}  // namespace
}  // namespace touchstone::lab
