// Lumps under a skin.

#include "sim/grasp/skinned_lump.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "fem/contact/press.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kDepth = 1.0;

SkinnedLump small() {
  SkinnedLump lump;
  lump.sphere_radius_mm = 6.0;
  lump.base_radius_mm = 6.0;
  lump.height_mm = 7.0;
  lump.mesh_mm = 1.0;
  return lump;
}

const test::TemporaryFolder& cache() {
  static const test::TemporaryFolder folder;
  return folder;
}

fem::PressTarget down_to(double z) {
  fem::PressTarget target;
  target.axis[2] = fem::AxisControl::at(z);
  return target;
}

/// Force of a rigid plate.
double under_plate(const fem::Compliance& piece) {
  fem::Press press(piece, fem::RoundedCylinder{7.0, 1.0, 3.0}, 0.0);
  return press.step(down_to(-kDepth)).wrench[2];
}

TEST(SkinnedLump, OfOneMaterialIsAPieceWithoutSkin) {
  SkinnedLump bare = small();
  bare.skin_mm = 0.0;
  const double whole = under_plate(*set_up_lump(bare, 1.0, cache().path()));
  const double skinned = under_plate(*set_up_lump(small(), 1.0, cache().path()));
  // Two meshes of one body, 1 mm coarse under a contact of 2.4 mm.
  EXPECT_NEAR(skinned, whole, 0.04 * whole);
}

TEST(SkinnedLump, GetsStifferWithItsCoreUpToARigidOnes) {
  double before = 0.0;
  for (const double ratio : {0.1, 1.0, 10.0, 1e3}) {
    const double force = under_plate(*set_up_lump(small(), ratio, cache().path()));
    EXPECT_GT(force, 1.05 * before) << ratio;
    before = force;
  }
  EXPECT_NEAR(under_plate(*set_up_lump(small(), 1e6, cache().path())), before, 0.01 * before);
}

TEST(SkinnedLump, PressesAPlateAsAPlatePressesItWhereTheContactIsSmall) {
  // Turned over, as a body on a hard pad, against the piece as the gel under a rigid plate. The two differ in the
  // normals that contact acts along, by more the wider it gets.
  SkinnedLump lump = small();
  lump.mesh_mm = 0.7;
  constexpr double kShallow = 0.4;
  const auto piece = set_up_lump(lump, 3.0, cache().path());
  const auto plate = set_up_plate(lump, cache().path());
  fem::Press turned(*plate, std::vector<fem::PressBody>{
                                {fem::SphereShape{lump.sphere_radius_mm}, 0.0, as_pressing_body(lump, *piece, 1.0)}});
  const double force = turned.step(down_to(lump.sphere_radius_mm - kShallow)).wrench[2];
  fem::Press upright(*piece, fem::RoundedCylinder{7.0, 1.0, 3.0}, 0.0);
  const double expected = upright.step(down_to(-kShallow)).wrench[2];
  EXPECT_NEAR(force, expected, 0.06 * expected) << "edges of 0.7 mm under a contact of 1.6 mm";
  // And in proportion to its moduli, where the plate is as hard.
  fem::Press half(*plate, std::vector<fem::PressBody>{
                              {fem::SphereShape{lump.sphere_radius_mm}, 0.0, as_pressing_body(lump, *piece, 0.5)}});
  EXPECT_NEAR(half.step(down_to(lump.sphere_radius_mm - kShallow)).wrench[2], 0.5 * force, 0.005 * force);
}

TEST(SkinnedLump, ModesScaleWithTheRootOfTheModuliAndAreCached) {
  SkinnedLump coarse = small();
  coarse.mesh_mm = 2.0;
  const fem::GelVibration light = set_up_lump_vibration(coarse, 2.0, 1000.0, 3, cache().path());
  const fem::GelVibration heavy = set_up_lump_vibration(coarse, 2.0, 4000.0, 3, cache().path());
  EXPECT_LT((light.angular_frequency - 2.0 * heavy.angular_frequency).norm(), 1e-8 * light.angular_frequency.norm());
  const fem::GelVibration again = set_up_lump_vibration(coarse, 2.0, 1000.0, 3, cache().path());
  EXPECT_EQ(again.angular_frequency, light.angular_frequency);
  // A harder skin on the same core swings faster, or a softer core more slowly.
  const fem::GelVibration soft = set_up_lump_vibration(coarse, 0.2, 1000.0, 3, cache().path());
  EXPECT_LT(soft.angular_frequency[0], 0.7 * light.angular_frequency[0]);
}

TEST(SkinnedLump, WhatMakesNoSenseIsRefused) {
  EXPECT_THAT(test::message_of([] { set_up_lump(small(), 0.0, {}); }), HasSubstr("core_over_skin is 0"));
  const auto piece = set_up_lump(small(), 3.0, cache().path());
  EXPECT_THAT(test::message_of([&] { as_pressing_body(small(), *piece, -1.0); }), HasSubstr("skin_MPa is -1"));
  SkinnedLump thick = small();
  thick.skin_mm = 9.0;
  EXPECT_THAT(test::message_of([&] { lump_body(thick); }), HasSubstr("layers"));
  thick.skin_mm = -1.0;
  EXPECT_THAT(test::message_of([&] { lump_body(thick); }), HasSubstr("skin_mm is -1"));
}

}  // namespace
}  // namespace touchstone::sim
