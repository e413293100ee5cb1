#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "render/direct/light_field.h"
#include "tests/render/direct/direct_scenes.h"

namespace touchstone::render {
namespace {

TEST(LightField, HoldsWhatLampsSend) {
  const Scene scene = lit_stack(0.0);
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(2e-3));
  EXPECT_LE(field.error, 2e-3);
  EXPECT_GT(field.error, 0.0);
  LightFieldSettings many;
  many.lens_points = 12;  // nine times the places on the lens
  std::mt19937 random(3);
  std::uniform_real_distribution<double> side(-7.0, 7.0);
  std::uniform_real_distribution<double> depth(-1.5, 0.0);
  double wrong = 0.0;
  double whole = 0.0;
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d at(side(random), side(random), depth(random));
    float flow[12];
    look_up_flow(field, find_cell(field, float(at.x()), float(at.y()), float(at.z())), flow);
    double wrong_here = 0.0;
    double whole_here = 0.0;
    for (int lamp = 0; lamp < 3; ++lamp) {
      const Eigen::Vector4d exact = exact_flow(field, lamp, at, many);
      wrong_here += (Eigen::Vector3d(flow[4 * lamp], flow[4 * lamp + 1], flow[4 * lamp + 2]) - exact.head<3>()).norm();
      whole_here += exact[3];
    }
    wrong += wrong_here * wrong_here;
    whole += whole_here * whole_here;
  }
  EXPECT_LT(std::sqrt(wrong / whole), field.error + 5e-4);
}

TEST(LightField, ErrorFallsWithTheGrid) {
  const Scene scene = lit_stack(0.0);
  const LightField coarse = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const LightField fine = make_light_field(scene, reach_of_membrane(), accuracy(5e-4));
  EXPECT_LE(fine.error, 5e-4);
  EXPECT_LE(coarse.error, 1e-2);
  EXPECT_GT(fine.nodes.prod(), coarse.nodes.prod());
}

TEST(LightField, IsCountedFromSomeOfItsPlaces) {
  const Scene scene = lit_stack(0.0);
  const LightFieldCount coarse = count_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(5e-4));
  const LightFieldCount fine = count_light_field(scene, reach_of_membrane(), accuracy(5e-4));
  EXPECT_TRUE(coarse.fits && fine.fits);
  EXPECT_GT(fine.places, coarse.places);
  // Its nodes, a grid more or less, and the places of each grid where its error is judged.
  EXPECT_GE(fine.places, 0.5 * field.nodes.prod());
  EXPECT_LE(fine.places, 2.0 * field.nodes.prod() + 4e3 * 20.0);
  EXPECT_LE(fine.looked_at, fine.places);
  const LightFieldCount finest = count_light_field(scene, reach_of_membrane(), accuracy(5e-5));
  EXPECT_LT(finest.looked_at, finest.places) << "the finest grids are counted without being made";
  Scene absorbing = scene;
  for (Medium& medium : absorbing.media) medium.absorption = flat_spectrum(scene.environment.size(), 0.1);
  const LightFieldCount dim = count_light_field(absorbing, reach_of_membrane(), accuracy(5e-4));
  EXPECT_GT(dim.places, fine.places + 0.5 * field.nodes.prod()) << "each band's absorption is computed, too";
  LightFieldSettings few = accuracy(1e-4);
  few.most_flows = 5000;
  EXPECT_FALSE(count_light_field(scene, reach_of_membrane(), few).fits);
}

TEST(LightField, RefusesWhatItCannotHold) {
  const Scene scene = lit_stack(0.0);
  const Eigen::AlignedBox3d reach = reach_of_membrane();
  Scene dark = scene;
  dark.lamps.clear();
  EXPECT_THROW(make_light_field(dark, reach), Error);
  EXPECT_THROW(make_light_field(scene, Eigen::AlignedBox3d{}), Error);
  EXPECT_THROW(make_light_field(scene, {Eigen::Vector3d(-1, -1, -6), Eigen::Vector3d(1, 1, 0)}), Error);  // a face
  Scene inside = scene;
  std::get<SpotLamp>(inside.lamps[0]).position = {0, 0, -1};
  EXPECT_THROW(make_light_field(inside, reach), Error);
  for (double bad : {0.0, -1.0, 2.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(make_light_field(scene, reach, accuracy(bad)), Error);
  }
  Scene sharp = scene;  // a lobe whose sharp rim crosses the membrane
  std::get<SpotLamp>(sharp.lamps[0]).half_angle = 0.1;
  std::get<SpotLamp>(sharp.lamps[0]).soft_angle = 0.0;
  std::get<SpotLamp>(sharp.lamps[0]).lens_radius = 0.0;
  LightFieldSettings small = accuracy(1e-4);
  small.most_flows = 5000;
  EXPECT_THROW(make_light_field(sharp, reach, small), Error);
}

TEST(LightField, TakesAStripBesideItsBoxAndRefusesOneThatReachesIn) {
  Scene scene = lit_stack(0.0);
  const Eigen::AlignedBox3d reach = reach_of_membrane();
  AreaLamp strip;
  strip.width = 2.0 * reach.sizes().maxCoeff();  // its bounding sphere holds the box
  strip.height = 1.0;
  strip.along = {0, 1, 0};
  strip.direction = {-1, 0, 0};
  strip.centre = {reach.max().x() + 2.0, 0, 0.5 * (reach.min().z() + reach.max().z())};
  strip.power_W = lamp_power(scene.lamps[0]);
  scene.lamps = {strip};
  EXPECT_LE(make_light_field(scene, reach, accuracy(2e-2)).error, 2e-2);
  // Turned by 45 degrees about z it goes through the box's corner.
  strip.along = {1, 1, 0};
  strip.direction = {-1, 1, 0};
  scene.lamps = {strip};
  EXPECT_THROW(make_light_field(scene, reach, accuracy(2e-2)), Error);
  strip.along = {0, 1, 0};
  strip.direction = {-1, 0, 0};
  strip.centre.x() = reach.max().x();
  scene.lamps = {strip};
  EXPECT_THROW(make_light_field(scene, reach, accuracy(2e-2)), Error) << "touches";
}

}  // namespace
}  // namespace touchstone::render
