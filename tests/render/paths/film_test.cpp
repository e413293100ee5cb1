// Thin coloured films and diffuse transmitters.

#include <gtest/gtest.h>

#include <cmath>

#include "closed_forms/light_closed_forms.h"
#include "core/random.h"
#include "core/units.h"
#include "light_scenes.h"
#include "render/materials/fresnel.h"
#include "render/materials/thin_film.h"

namespace touchstone::render {
namespace {

TEST(ThinFilm, DyeFollowsThePathInside) {
  const Bands<3> dye(0.9, 0.5, 0.01);
  for (double angle : {0.0, 0.4, 1.0, 1.5}) {
    const double inside = std::cos(std::asin(std::sin(angle) / 1.5));
    const FilmLight<3> light = film_light<3>(dye, 1.5, false, 1.0, std::cos(angle));
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(light.passed[i], std::pow(dye[i], 1.0 / inside), 1e-12);
    EXPECT_EQ(light.reflected.maxCoeff(), 0.0);
  }
}

// A clear plate: T = 1/2 sum (1-R)/(1+R).
TEST(ThinFilm, ClearFoilIsAPlate) {
  const auto passed = [](double angle) {
    return film_light<1>(Bands<1>(1.0), 1.5, true, 1.0, std::cos(angle)).passed[0];
  };
  EXPECT_NEAR(passed(0.0), 12.0 / 13.0, 1e-12);
  EXPECT_NEAR(passed(0.25 * kPi), 0.9073, 1e-4);
  for (double cosine : {0.0, 0.01, 0.3, 0.7, 1.0}) {
    for (double medium : {1.0, 1.41, 1.6}) {
      const FilmLight<1> light = film_light<1>(Bands<1>(1.0), 1.5, true, medium, cosine);
      EXPECT_NEAR(light.passed[0] + light.reflected[0], 1.0, 1e-12) << cosine << " " << medium;
      const FilmLight<1> dyed = film_light<1>(Bands<1>(0.3), 1.5, true, medium, cosine);
      EXPECT_LE(dyed.passed[0] + dyed.reflected[0], 1.0 + 1e-12);
      EXPECT_LE(dyed.passed[0], light.passed[0]);
    }
  }
}

TEST(ThinFilm, TwoFilmsMultiply) {
  Scene scene = empty_scene(1.0);
  scene.surfaces.push_back({square_sheet(100.0, 1.0), ThinFilm{grey(0.6), 1.5}});
  scene.surfaces.push_back({square_sheet(100.0, 2.0, false), ThinFilm{grey(0.7), 1.5}});
  const Eigen::Vector3d direction(std::sin(0.5), 0, std::cos(0.5));
  const double inside = std::cos(std::asin(std::sin(0.5) / 1.5));
  const double seen = Tracer(scene).radiance({0, 0, 0}, direction, samples(1))[0];
  EXPECT_NEAR(seen, std::pow(0.42, 1.0 / inside), 1e-9);
}

TEST(ThinFilm, ClearFoilsAreAWhiteFurnace) {
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(1000.0, -3.0), ThinFilm{grey(1.0), 1.6, true}});
  scene.surfaces.push_back({square_sheet(1000.0, -2.0), ThinFilm{grey(1.0), 1.3, true}});
  scene.balls.push_back({{0, 0, 0}, 1.0, ThinFilm{grey(1.0), 1.5, true}});
  scene.balls.push_back({{0, 0, 0}, 0.5, Lambertian{grey(1.0)}});
  for (double slant : {0.0, 0.05, 0.6}) {
    const Estimate seen = view(scene, {0, 0, -27}, {slant, 0, 1}, 100);
    EXPECT_NEAR(seen.mean, 1.0, 4.0 * seen.error + 1e-9);
    EXPECT_LT(seen.error, 0.02);
  }
}

TEST(ThinFilm, LampShinesThroughIt) {
  for (bool mirrors : {false, true}) {
    Scene scene = empty_scene(0.0);
    scene.surfaces.push_back({square_sheet(50.0, 0.0), Lambertian{grey(0.5)}});
    scene.lamps.push_back(half_space_lamp({4, 0, 5}, {0, 0, -1}, 1.0));
    const double bare = Tracer(scene).radiance({0, 0, 1}, {0, 0, -1}, samples(1, 0))[0];
    scene.surfaces.push_back({square_sheet(50.0, 2.0), ThinFilm{grey(0.3), 1.5, mirrors}});
    const double filtered = Tracer(scene).radiance({0, 0, 1}, {0, 0, -1}, samples(1, 0))[0];
    const double expected = film_light<1>(Bands<1>(0.3), 1.5, mirrors, 1.0, 5.0 / std::hypot(4.0, 5.0)).passed[0];
    EXPECT_NEAR(filtered / bare, expected, 1e-6);  // Embree tells a hit in a 50 mm triangle to 3e-6 mm
  }
}

// Inside a gel the angle is that of the refracted path.
TEST(ThinFilm, LampShinesThroughItBehindFaces) {
  Scene scene = sensor_stack(0.0);
  scene.surfaces.push_back({square_sheet(50.0, 0.0, false), Lambertian{grey(0.5)}});
  scene.lamps.push_back(half_space_lamp({10, 0, -20}, {0, 0, 1}, 1.0));
  const Eigen::Vector3d from(0, 0, -0.5);
  const double bare = Tracer(scene).radiance(from, {0, 0, 1}, samples(1, 0))[0];
  scene.surfaces.push_back({square_sheet(50.0, -1.0), ThinFilm{grey(0.3), 1.41}});
  const double filtered = Tracer(scene).radiance(from, {0, 0, 1}, samples(1, 0))[0];
  // Snell's path by bisection on the sine in air.
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 100; ++i) {
    const double s = 0.5 * (low + high);
    const auto reach = [s](double h, double n) { return h * (s / n) / std::sqrt(1.0 - s * s / n / n); };
    (reach(13.0, 1.0) + reach(2.0, 1.52) + reach(5.0, 1.41) < 10.0 ? low : high) = s;
  }
  const double cosine = std::sqrt(1.0 - low * low / 1.41 / 1.41);
  EXPECT_NEAR(filtered / bare, std::pow(0.3, 1.0 / cosine), 1e-7);
}

TEST(DiffuseTransmitter, SheetInLightGivesBackBothShares) {
  for (double passed : {0.0, 0.5, 0.7}) {
    Scene scene = empty_scene(1.0);
    scene.surfaces.push_back({square_sheet(10.0, 0.0), DiffuseTransmitter{grey(0.3), grey(passed)}});
    EXPECT_NEAR(Tracer(scene).radiance({0, 0, 3}, {0.3, 0, -1}, samples(64))[0], 0.3 + passed, 1e-12);
  }
}

// Inside a sphere of it L = T Le + R L.
TEST(DiffuseTransmitter, HollowSphereFillsWithLight) {
  for (double reflectance : {0.2, 0.5, 0.8}) {
    const double passed = 0.9 - reflectance;
    Scene scene = empty_scene(1.0);
    scene.balls.push_back({{0, 0, 0}, 2.0, DiffuseTransmitter{grey(reflectance), grey(passed)}});
    const Estimate seen = view(scene, {0.3, 0.2, 0.1}, {1, 0.4, 0.2}, 400);
    EXPECT_NEAR(seen.mean, passed / (1.0 - reflectance), 3.5 * seen.error) << reflectance;
    EXPECT_LT(seen.error, 0.01);
  }
}

// Light goes to and fro between the sheet and a wall close behind it: R + T^2 b / (1 - R b).
TEST(DiffuseTransmitter, AWallBehindTheSheetIsSeenThroughIt) {
  for (double wall : {0.0, 0.3, 1.0}) {
    Scene scene = empty_scene(1.0);
    const DiffuseTransmitter sheet{grey(0.5), grey(0.4)};
    scene.surfaces.push_back({square_sheet(100.0, 0.0), sheet});
    scene.surfaces.push_back({square_sheet(100.0, -0.001), Lambertian{grey(wall)}});
    const Estimate seen = view(scene, {0, 0, 3}, {0.3, 0, -1}, 400);
    EXPECT_NEAR(reflectance_over(sheet, grey(wall))[0], 0.5 + 0.16 * wall / (1.0 - 0.5 * wall), 1e-12);
    EXPECT_NEAR(seen.mean, reflectance_over(sheet, grey(wall))[0], 3.5 * seen.error + 1e-9) << wall;
    EXPECT_LT(seen.error, 0.005);
  }
}

// In a gel, close before its face to air: the face sends back 0.536 of diffuse light at an index of 1.41. Radiance is
// basic.
TEST(DiffuseTransmitter, ASheetBeforeItsMediumsFaceGetsItsLightBack) {
  const double face = diffuse_reflectance_within(1.41);
  EXPECT_NEAR(face, closed_forms::internal_diffuse_reflectance(1.41), 2e-4);
  EXPECT_NEAR(diffuse_reflectance_within(1.5), 0.596, 5e-4);
  EXPECT_NEAR(diffuse_reflectance_within(1.0), 0.0, 1e-12);
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{1.41, {}}, Medium{1.0, {}}};
  scene.faces = {{0.001, 0, 1}};
  const DiffuseTransmitter sheet{grey(0.4), grey(0.5)};
  scene.surfaces.push_back({square_sheet(200.0, 0.0), sheet});
  scene.surfaces.push_back({square_sheet(200.0, -2.0), Emitter{grey(1.0)}});
  const Estimate seen = view(scene, {0, 0, -1}, {0.2, 0, 1}, 2000);
  EXPECT_NEAR(seen.mean, reflectance_over(sheet, grey(face))[0], 3.5 * seen.error);
  EXPECT_LT(seen.error, 0.01);
}

TEST(DiffuseTransmitter, WhiteHollowSphereIsAWhiteFurnace) {
  Scene scene = empty_scene(1.0);
  scene.balls.push_back({{0, 0, 0}, 2.0, DiffuseTransmitter{grey(0.6), grey(0.4)}});
  const Estimate seen = view(scene, {0.3, 0.2, 0.1}, {1, 0.4, 0.2}, 50);
  EXPECT_NEAR(seen.mean, 1.0, 1e-9);
}

// A point lamp of intensity I at distance r: L = share I cos / (pi r^2), share R before the sheet and T behind it.
TEST(DiffuseTransmitter, LampLightsBothSides) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(50.0, 0.0), DiffuseTransmitter{grey(0.3), grey(0.5)}});
  scene.lamps.push_back(half_space_lamp({3, 0, 4}, {0, 0, -1}, 2.0));
  const double irradiance = 2.0 * 0.8 / (25.0 * 1e-6);
  const Tracer tracer(scene);
  EXPECT_NEAR(tracer.radiance({0, 0, 1}, {0, 0, -1}, samples(1, 0))[0], 0.3 * irradiance / kPi, 1e-6 * irradiance);
  EXPECT_NEAR(tracer.radiance({0, 0, -1}, {0, 0, 1}, samples(1, 0))[0], 0.5 * irradiance / kPi, 1e-6 * irradiance);
}

}  // namespace
}  // namespace touchstone::render
