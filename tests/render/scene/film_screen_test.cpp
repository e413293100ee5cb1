// Films as direct light sees them: how much of what passes meets film, and what film leaves of it.

#include "render/scene/film_screen.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/units.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

Spectrum three(double red, double green, double blue) {
  Spectrum spectrum(3);
  spectrum << red, green, blue;
  return spectrum;
}

Surface film(double half, double z, const Spectrum& transmittance) {
  return {square_sheet(half, z), ThinFilm{transmittance, 1.5}};
}

/// A film turned by 0.3 about its middle.
Surface turned_film(double half, const Eigen::Vector2d& middle, double z) {
  Surface made = film(half, z, grey(0.5));
  const Eigen::Rotation2Dd turn(0.3);
  for (Eigen::Vector3d& vertex : made.mesh.vertices) vertex.head<2>() = middle + turn * vertex.head<2>();
  return made;
}

Scene with_films(std::vector<Surface> films) {
  Scene scene = empty_scene(0.0);
  scene.environment = Spectrum::Zero(std::get<ThinFilm>(films.front().material).transmittance.size());
  scene.surfaces = std::move(films);
  return scene;
}

TEST(FilmScreen, CoversAddUpToTheFilmsArea) {
  const Scene scene = with_films({turned_film(0.43, {0.1, 0.2}, -3.0), turned_film(0.31, {1.3, -0.4}, -3.0)});
  const double area = 4.0 * (0.43 * 0.43 + 0.31 * 0.31);
  for (const auto& [radius, sigma] : {std::pair{0.0, 0.0}, {0.1, 0.3}, {0.5, 1.0}}) {
    const FilmScreen screen(scene, 1.41, radius, sigma);
    double camera = 0.0;
    double lamps = 0.0;
    constexpr double kStep = 0.0113;
    for (double y = -6.0; y < 6.0; y += kStep) {
      for (double x = -6.0; x < 6.0; x += kStep) {
        const double seen = screen.camera_cover(float(x), float(y));
        const double lit = screen.lamp_cover(float(x), float(y));
        ASSERT_TRUE(seen >= -1e-6 && seen <= 1.0 + 1e-5) << seen;
        ASSERT_TRUE(lit >= -1e-6 && lit <= 1.0 + 1e-5) << lit;
        camera += seen * kStep * kStep;
        lamps += lit * kStep * kStep;
      }
    }
    EXPECT_NEAR(camera, area, 2e-3 * area) << radius;
    EXPECT_NEAR(lamps, area, 5e-3 * area) << sigma;  // 0.3 % of a Gaussian are beyond three sigma
  }
}

// Beyond a straight edge a disc is covered by its segment.
TEST(FilmScreen, TheCameraSeesTheMeanOverADisc) {
  constexpr double kRadius = 0.3;
  const FilmScreen screen(with_films({film(2.0, 0.0, grey(0.5))}), 1.41, kRadius, 0.0);
  for (double beyond = -0.4; beyond <= 0.4; beyond += 0.05) {
    const double d = std::clamp(beyond / kRadius, -1.0, 1.0);
    const double segment = (std::acos(d) - d * std::sqrt(1.0 - d * d)) / kPi;
    for (const auto& [x, y] : {std::pair{2.0 + beyond, 0.3}, {-2.0 - beyond, 0.3}, {0.3, 2.0 + beyond}}) {
      EXPECT_NEAR(screen.camera_cover(float(x), float(y)), segment, 0.01) << beyond;
    }
  }
  EXPECT_EQ(screen.camera_cover(50.0f, 0.0f), 0.0f);
  EXPECT_EQ(screen.camera_cover(std::numeric_limits<float>::quiet_NaN(), 0.0f), 0.0f);
}

TEST(FilmScreen, LampsSeeTheMeanOfAGaussian) {
  constexpr double kSigma = 0.8;
  const FilmScreen screen(with_films({film(5.0, 0.0, grey(0.5))}), 1.41, 0.0, kSigma);
  for (double beyond = -2.0; beyond <= 2.0; beyond += 0.25) {
    const double expected = 0.5 * std::erfc(beyond / (kSigma * std::sqrt(2.0)));
    EXPECT_NEAR(screen.lamp_cover(float(5.0 + beyond), 0.2f), expected, 0.01) << beyond;
    EXPECT_NEAR(screen.lamp_cover(-0.2f, float(-5.0 - beyond)), expected, 0.01) << beyond;
  }
}

TEST(FilmScreen, LeavesWhatAThinFilmLeaves) {
  const Bands<3> dye(0.97, 0.5, 0.01);
  for (const double medium : {1.0, 1.41}) {
    const FilmScreen screen(with_films({film(1.0, 0.0, three(dye[0], dye[1], dye[2]))}), medium, 0.0, 0.0);
    for (double cosine = 0.0; cosine <= 1.0; cosine += 0.01) {
      const Bands<3> whole = film_light<3>(dye, 1.5, false, medium, cosine).passed;
      for (const double cover : {0.0, 0.4, 1.0}) {
        FilmScreen::Light light;
        screen.add(2.0f, float(cover), float(cosine), light);
        float left[3];
        screen.pass(light, left);
        for (int band = 0; band < 3; ++band) {
          const double expected = 2.0 * (1.0 - cover + cover * whole[band]);
          EXPECT_NEAR(left[band], expected, 4e-3) << medium << " " << cosine << " " << band;
          EXPECT_LE(left[band], 2.0f + 1e-6f);
          EXPECT_GE(left[band], 0.0f);
        }
      }
    }
  }
}

TEST(FilmScreen, LightOfManyDirectionsAddsUp) {
  const FilmScreen screen(with_films({film(1.0, 0.0, three(0.9, 0.5, 0.02))}), 1.41, 0.0, 0.0);
  FilmScreen::Light together;
  double apart[3] = {};
  for (int k = 0; k < 50; ++k) {
    const float amount = 0.1f + 0.05f * static_cast<float>(k % 7);
    const float cover = static_cast<float>(k % 11) / 10.0f;
    const float cosine = static_cast<float>(k) / 49.0f;
    FilmScreen::Light one;
    screen.add(amount, cover, cosine, one);
    screen.add(amount, cover, cosine, together);
    float left[3];
    screen.pass(one, left);
    for (int band = 0; band < 3; ++band) apart[band] += left[band];
  }
  float left[3];
  screen.pass(together, left);
  for (int band = 0; band < 3; ++band) EXPECT_NEAR(left[band], apart[band], 1e-5 * apart[band]);
}

TEST(FilmScreen, TakesLevelFilmsOfOneKindOnly) {
  const auto fault = [](Surface other) {
    return unfit_for_screen(with_films({film(1.0, -3.0, grey(0.5)), std::move(other)}));
  };
  EXPECT_EQ(unfit_for_screen(empty_scene(0.0)), "");
  EXPECT_TRUE(FilmScreen(empty_scene(0.0), 1.0, 0.1, 0.1).empty());
  Surface next = film(1.0, -3.0, grey(0.5));
  EXPECT_EQ(fault(next), "");
  EXPECT_NE(fault(film(1.0, -3.0, grey(0.6))).find("colours"), std::string::npos);
  EXPECT_NE(fault(film(1.0, -2.9, grey(0.5))).find("level"), std::string::npos);
  next.mesh.vertices[2].z() += 0.01;
  EXPECT_NE(fault(next).find("level"), std::string::npos);
  next = film(1.0, -3.0, grey(0.5));
  std::get<ThinFilm>(next.material).index = 1.4;
  EXPECT_NE(fault(next).find("colours"), std::string::npos);
  std::get<ThinFilm>(next.material) = ThinFilm{grey(0.5), 1.5, true};
  EXPECT_NE(fault(next).find("mirror"), std::string::npos);
}

TEST(FilmScreen, SameFilmIsOfOneShapePlaceAndKind) {
  const Surface one = film(1.0, -3.0, grey(0.5));
  EXPECT_TRUE(same_film(one, film(1.0, -3.0, grey(0.5))));
  EXPECT_FALSE(same_film(one, film(1.1, -3.0, grey(0.5))));
  EXPECT_FALSE(same_film(one, film(1.0, -3.1, grey(0.5))));
  EXPECT_FALSE(same_film(one, film(1.0, -3.0, grey(0.6))));
  EXPECT_FALSE(same_film(one, {square_sheet(1.0, -3.0, false), ThinFilm{grey(0.5), 1.5}}));
  EXPECT_FALSE(same_film(one, {square_sheet(1.0, -3.0), Lambertian{grey(0.5)}}));
}

}  // namespace
}  // namespace touchstone::render
