// The choice of one lamp a hit.
#include "render/lamps/lamp_choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "render/lamps/lamp_connection.h"
#include "render/paths/path_tracer.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

const Eigen::Vector3d kUp(0.0, 0.0, 1.0);

/// Eleven lamps in a row below z = 0, the fourth one off.
LampChooser row_of_lamps() {
  LampChooser chooser;
  for (int k = 0; k < 11; ++k) {
    chooser.add({3.0 * k - 15.0, 0.0, -5.0}, k == 3 ? 0.0 : 1.0 + 0.1 * k, 1.0);
  }
  return chooser;
}

/// What a lamp of row_of_lamps sends, 1 / distance^2 and no more; none beyond 14 mm.
Eigen::Vector3d light_of_row(int lamp, const Eigen::Vector3d& place) {
  const Eigen::Vector3d offset = Eigen::Vector3d(3.0 * lamp - 15.0, 0.0, -5.0) - place;
  if (lamp == 3 || offset.norm() > 14.0) return Eigen::Vector3d::Zero();
  return offset.normalized() * ((1.0 + 0.1 * lamp) * 1e5 / offset.squaredNorm());
}

/// The share of the numbers 0 to 1 that give each lamp is what choose() says, and the shares fill one.
void expect_stated_chances(const LampChooser& chooser, const Eigen::Vector3d& place, const Eigen::Vector3d* normal) {
  constexpr int kNumbers = 200000;
  std::vector<int> times(11, 0);
  std::vector<double> stated(11, 0.0);
  for (int i = 0; i < kNumbers; ++i) {
    const LampChoice choice = chooser.choose(place, normal, 1.41, (i + 0.5) / kNumbers);
    ASSERT_GE(choice.lamp, 0);
    ASSERT_LT(choice.lamp, 11);
    if (++times[choice.lamp] == 1) {
      EXPECT_EQ(chooser.chance_of(choice.lamp, place, normal, 1.41), choice.probability);
    }
    stated[choice.lamp] = choice.probability;
  }
  double sum = 0.0;
  for (int lamp = 0; lamp < 11; ++lamp) {
    EXPECT_NEAR(times[lamp] / double(kNumbers), stated[lamp], 2e-5) << "lamp " << lamp;
    sum += stated[lamp];
    if (lamp == 3) {
      EXPECT_EQ(times[lamp], 0);
    } else {
      EXPECT_GT(stated[lamp], 1e-4) << "lamp " << lamp << " shines and is left out";
    }
  }
  EXPECT_NEAR(sum, 1.0, 1e-5);
}

TEST(LampChoice, EachLampComesAsOftenAsItsProbabilitySays) {
  LampChooser chooser = row_of_lamps();
  const Eigen::Vector3d down = -kUp;
  const Eigen::Vector3d tilted = Eigen::Vector3d(0.6, 0.0, -0.8);
  for (const bool grid : {false, true}) {
    if (grid) chooser.lay_grid({Eigen::Vector3d(-10, -10, 0), Eigen::Vector3d(10, 10, 1)}, light_of_row);
    for (const Eigen::Vector3d& place : {Eigen::Vector3d(0.3, 0.2, 0.5), Eigen::Vector3d(-9.9, 9.9, 0.0),
                                         Eigen::Vector3d(10.0, 10.0, 1.0), Eigen::Vector3d(40.0, 0.0, 0.0)}) {
      for (const Eigen::Vector3d* normal : {static_cast<const Eigen::Vector3d*>(nullptr), &down, &tilted, &kUp}) {
        expect_stated_chances(chooser, place, normal);
      }
    }
  }
}

TEST(LampChoice, FollowsTheLightInTheCell) {
  LampChooser chooser = row_of_lamps();
  chooser.lay_grid({Eigen::Vector3d(-10, -10, 0), Eigen::Vector3d(10, 10, 1)}, light_of_row);
  const Eigen::Vector3d down = -kUp;
  const Eigen::Vector3d place(0.42, 0.42, 0.5);
  std::vector<double> light(11);
  double whole = 0.0;
  for (int lamp = 0; lamp < 11; ++lamp) whole += light[lamp] = std::max(0.0, light_of_row(lamp, place).dot(down));
  for (int i = 0; i < 1000; ++i) {
    const LampChoice choice = chooser.choose(place, &down, 1.41, (i + 0.5) / 1000);
    if (light[choice.lamp] > 0.02 * whole) {
      EXPECT_NEAR(choice.probability * whole / light[choice.lamp], 1.0, 0.1) << choice.lamp;
    }
  }
}

TEST(LampChoice, ManyLampsDarkLampsAndOneLampAreAllTaken) {
  LampChooser many;
  for (int k = 0; k < 100; ++k) many.add({k * 1.0, 0, -5}, 1.0, 1.0);
  EXPECT_EQ(many.choose({0, 0, 0}, nullptr, 1.0, 0.999).lamp, 99);
  EXPECT_DOUBLE_EQ(many.choose({0, 0, 0}, nullptr, 1.0, 0.5).probability, 0.01);
  LampChooser dark;
  dark.add({0, 0, -5}, 0.0, 1.0);
  dark.add({1, 0, -5}, 0.0, 1.0);
  dark.lay_grid({Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(1, 1, 1)},
                [](int, const Eigen::Vector3d&) { return Eigen::Vector3d(Eigen::Vector3d::Zero()); });
  EXPECT_DOUBLE_EQ(dark.choose({0, 0, 0}, nullptr, 1.0, 0.9).probability, 1.0);  // any will do
  LampChooser one;
  one.add({0, 0, -5}, 0.0, 1.0);
  EXPECT_DOUBLE_EQ(one.choose({0, 0, 0}, &kUp, 1.0, 0.9).probability, 1.0);
}

/// Two lamps, of which one shines from the side only into a part of the sheet: the light seen is that of both alone.
TEST(LampChoice, LightOfSeveralLampsIsTheSumOfEachAlone) {
  Scene scene = sensor_stack(0.0);
  scene.surfaces.push_back({square_sheet(8.0, 0.0, false), Lambertian{grey(0.7)}});
  for (int k = 0; k < 5; ++k) {
    SpotLamp lamp = half_space_lamp({10.0 * std::cos(k), 10.0 * std::sin(k), -12.0}, {0, 0, 1}, 0.1 + 0.05 * k);
    lamp.half_angle = 0.5;
    lamp.soft_angle = 0.05;
    lamp.lens_radius = 1.0;
    lamp.direction = (Eigen::Vector3d(2.0 * (k % 2), 0, 0) - lamp.position).normalized();
    scene.lamps.push_back(lamp);
  }
  const auto seen = [](const Scene& of, double x) {
    return Tracer(of).radiance({x, 0.0, -3.0}, {0, 0, 1}, samples(1 << 17, 0))[0];
  };
  for (double x : {-6.0, -2.0, 0.5, 4.0, 7.0}) {
    double sum = 0.0;
    Scene alone = scene;
    for (const auto& lamp : scene.lamps) {
      alone.lamps = {lamp};
      sum += seen(alone, x);
    }
    const double all = seen(scene, x);
    EXPECT_NEAR(all, sum, 5e-3 * std::max(sum, 1e-6)) << "x " << x;
  }
}

}  // namespace
}  // namespace touchstone::render
