// What differs from grasp to grasp.

#include "lab/dvs_grasps.h"

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

}  // namespace
}  // namespace touchstone::lab
