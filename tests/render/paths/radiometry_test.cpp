// Radiances against closed forms (closed_forms/light_closed_forms.h).

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "closed_forms/light_closed_forms.h"
#include "core/units.h"
#include "light_scenes.h"

namespace touchstone::render {
namespace {

Eigen::Vector3d slanted(double angle) {
  return {std::sin(angle), 0.0, std::cos(angle)};
}

TEST(Plate, PassesWhatAllInternalReflectionsLeave) {
  Scene scene = empty_scene(1.0);
  scene.media = {Medium{1.0, {}}, Medium{1.5, {}}};
  scene.faces = {{0.0, 0, 1}, {2.0, 1, 0}};
  scene.surfaces.push_back({square_sheet(1000.0, 10.0), Black{}});  // what the plate passes ends here
  const Tracer tracer(scene);
  EXPECT_NEAR(closed_forms::plate_transmittance(1.5, 0.0), 0.9231, 5e-5);
  EXPECT_NEAR(closed_forms::plate_transmittance(1.5, 0.25 * kPi), 0.9073, 5e-5);
  for (double angle : {0.0, 0.25 * kPi, 1.2}) {
    const double mirrored = tracer.radiance({0, 0, -5}, slanted(angle), samples(4096))[0];
    EXPECT_NEAR(1.0 - mirrored, closed_forms::plate_transmittance(1.5, angle), 3e-4) << angle;
  }
}

TEST(Absorption, FollowsBeerAndLambert) {
  Scene scene = empty_scene(1.0);
  scene.media = {Medium{1.0, {}}, Medium{1.0, grey(0.3)}};
  scene.faces = {{0.0, 0, 1}, {2.0, 1, 0}};
  const Tracer tracer(scene);
  for (double angle : {0.0, 0.8}) {
    EXPECT_NEAR(tracer.radiance({0, 0, -5}, slanted(angle), samples(1))[0], std::exp(-0.3 * 2.0 / std::cos(angle)),
                1e-12);
  }
  // The same for lamp light on its path through the layer and back.
  scene.environment = grey(0.0);
  scene.interreflection = false;
  scene.surfaces.push_back({square_sheet(10.0, 3.0, false), Lambertian{grey(0.5)}});
  scene.lamps.push_back(half_space_lamp({0, 0, -7}, {0, 0, 1}, 2.0));
  const double seen = Tracer(scene).radiance({0, 0, -5}, slanted(0.0), samples(1))[0];
  EXPECT_NEAR(seen / (closed_forms::lambertian_radiance(0.5, 2.0, 1.0, 10.0) * std::exp(-2.0 * 0.6)), 1.0, 1e-6);
}

TEST(PointLamp, LightsAMattSurfaceByTheInverseSquare) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.surfaces.push_back({square_sheet(50.0, 0.0, false), Lambertian{grey(0.7)}});
  scene.lamps.push_back(half_space_lamp({3, 0, -4}, {0, 0, 1}, 1.5));
  const Tracer tracer(scene);
  for (double x : {3.0, 0.0, -9.0}) {
    const double distance = std::hypot(x - 3.0, 4.0);
    const double expected = closed_forms::lambertian_radiance(0.7, 1.5, 4.0 / distance, distance);
    // Matt: the same from everywhere.
    for (const Eigen::Vector3d& eye : {Eigen::Vector3d(x, 0, -1), Eigen::Vector3d(x + 20, 5, -2)}) {
      const double seen = tracer.radiance(eye, Eigen::Vector3d(x, 0, 0) - eye, samples(1))[0];
      EXPECT_NEAR(seen / expected, 1.0, 1e-5) << "x " << x;
    }
  }
}

TEST(PointLamp, AllItsPowerLandsOnAWidePlane) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.surfaces.push_back({square_sheet(60.0, 0.0, false), Lambertian{grey(1.0)}});
  SpotLamp lamp;
  lamp.position = {0, 0, -20};
  lamp.direction = {0, 0, 1};
  lamp.lens_radius = 1.0;
  lamp.half_angle = 0.5;
  lamp.soft_angle = 0.3;
  lamp.power_W = grey(2.0);
  scene.lamps.push_back(lamp);
  const Tracer tracer(scene);
  double landed = 0.0;
  constexpr int kRings = 300;
  const double outermost = 30.0;
  for (int i = 0; i < kRings; ++i) {
    const double r = outermost * (i + 0.5) / kRings;
    const double irradiance = kPi * tracer.radiance({r, 0, -1}, {0, 0, 1}, samples(64))[0];
    landed += irradiance * 2.0 * kPi * r * outermost / kRings * 1e-6;  // mm^2 to m^2
  }
  EXPECT_NEAR(landed, 2.0, 2e-3);
}

TEST(PointLamp, ThroughGlassAndGelAgreesWithBisection) {
  Scene scene = sensor_stack(0.0);
  scene.interreflection = false;
  scene.lamps.push_back(half_space_lamp({0, 0, -27}, {0, 0, 1}, 1.0));
  scene.surfaces.push_back({square_sheet(50.0, 0.0, false), Lambertian{grey(0.8)}});
  const Tracer tracer(scene);
  const std::array<double, 3> thicknesses = {20.0, 2.0, 5.0};
  const std::array<double, 3> indices = {1.0, 1.52, 1.41};
  for (double x : {0.0, 5.0, 15.0, 40.0}) {
    const double sine = std::sin(std::atan(closed_forms::apparent_tangent(thicknesses, indices, x))) / 1.41;
    const double cosine = std::sqrt(1.0 - sine * sine);
    // Seen from within the gel; radiance() returns L / n^2.
    const double expected =
        0.8 / kPi * closed_forms::layered_irradiance(thicknesses, indices, x) * cosine / (1.41 * 1.41);
    EXPECT_NEAR(tracer.radiance({x, 0, -2}, {0, 0, 1}, samples(1))[0] / expected, 1.0, 1e-5) << "x " << x;
  }
}

TEST(PointLamp, OnAnObjectOffAFlatGelAgreesWithBisection) {
  Scene scene = sensor_stack(0.0);
  scene.interreflection = false;
  scene.lamps.push_back(half_space_lamp({0, 0, -27}, {0, 0, 1}, 1.0));
  scene.surfaces.push_back({square_sheet(60.0, 0.0), Refractive{2, 0}});
  scene.surfaces.push_back({square_sheet(50.0, 0.4, false), Lambertian{grey(0.8)}});
  const Tracer tracer(scene);
  const std::array<double, 4> thicknesses = {20.0, 2.0, 5.0, 0.4};
  const std::array<double, 4> indices = {1.0, 1.52, 1.41, 1.0};
  for (double x : {0.0, 5.0, 15.0}) {
    const double cosine = std::cos(std::atan(closed_forms::apparent_tangent(thicknesses, indices, x)));
    const double expected = 0.8 / kPi * closed_forms::layered_irradiance(thicknesses, indices, x) * cosine;
    // Seen through the gel along the normal: the face takes its share, twice mirrored light is not lamp light.
    const double face = std::pow(0.41 / 2.41, 2);
    const double seen = tracer.radiance({x, 0, -2}, {0, 0, 1}, samples(256))[0];
    EXPECT_NEAR(seen / (expected * (1.0 - face)), 1.0, 2e-3) << "x " << x;
  }
}

TEST(PointLamp, ShadowIsDarkThroughTheStack) {
  Scene scene = sensor_stack(0.0);
  scene.interreflection = false;
  scene.lamps.push_back(half_space_lamp({0, 0, -27}, {0, 0, 1}, 1.0));
  scene.surfaces.push_back({square_sheet(50.0, 0.0, false), Lambertian{grey(0.8)}});
  const std::array<double, 3> thicknesses = {20.0, 2.0, 5.0};
  const std::array<double, 3> indices = {1.0, 1.52, 1.41};
  const double x = 12.0;
  const double in_gel =
      std::tan(std::asin(std::sin(std::atan(closed_forms::apparent_tangent(thicknesses, indices, x))) / 1.41));
  // A bead on the refracted path, and not on the straight line: 0.3 mm beside the path lets light through.
  const Eigen::Vector3d on_path(x - 3.0 * in_gel, 0, -3.0);
  const auto lit = [&](const Eigen::Vector3d& bead) {
    Scene with_bead = scene;
    with_bead.balls.push_back({bead, 0.25, Black{}});
    return Tracer(with_bead).radiance({x, 0, -0.5}, {0, 0, 1}, samples(1))[0] > 0.0;
  };
  EXPECT_FALSE(lit(on_path));
  EXPECT_FALSE(lit(on_path + Eigen::Vector3d(0.2, 0, 0)));
  EXPECT_TRUE(lit(on_path + Eigen::Vector3d(0.35, 0, 0)));
  EXPECT_TRUE(lit(on_path - Eigen::Vector3d(0.35, 0, 0)));
}

// One lamp is traced a hit; over the samples of a pixel it must be all of them, also the dark one and many.
TEST(ManyLamps, AddUp) {
  for (const int count : {3, 40}) {
    Scene scene = empty_scene(0.0);
    scene.interreflection = false;
    scene.balls.push_back({{0, 0, 0}, 2.0, Lambertian{grey(0.7)}});
    std::vector<Lamp> lamps;
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * kPi * i / count;
      const Eigen::Vector3d position(12 * std::cos(angle), 12 * std::sin(angle), -10.0);
      lamps.push_back(half_space_lamp(position, -position, i == 1 ? 0.0 : 1.0 + i % 5));
    }
    const Eigen::Vector3d eye(0, 0, -30);
    for (const Eigen::Vector3d& target : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1.6, 0.3, 0)}) {
      double sum = 0.0;
      for (const Lamp& lamp : lamps) {
        scene.lamps = {lamp};
        sum += Tracer(scene).radiance(eye, target - eye, samples(1))[0];
      }
      scene.lamps = lamps;
      // Few lamps are weighed, so that samples hardly differ; many are drawn evenly.
      const double seen = Tracer(scene).radiance(eye, target - eye, samples(count > 32 ? 1 << 16 : 1 << 12))[0];
      EXPECT_NEAR(seen / sum, 1.0, 2e-3) << count << " lamps";
    }
  }
}

TEST(ManyLamps, AllDarkGiveNoLight) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(50.0, 0.0, false), Lambertian{grey(0.7)}});
  for (int i = 0; i < 3; ++i) scene.lamps.push_back(half_space_lamp({1.0 * i, 0, -4}, {0, 0, 1}, 0.0));
  EXPECT_EQ(Tracer(scene).radiance({0, 0, -1}, {0, 0, 1}, samples(16))[0], 0.0);
}

TEST(Panel, ShowsItsRadianceAndNothingElse) {
  Scene scene = empty_scene(5.0);
  scene.surfaces.push_back({square_sheet(50.0, 2.0, false), Emitter{grey(3.0)}});
  scene.lamps.push_back(half_space_lamp({0, 0, -4}, {0, 0, 1}, 100.0));
  for (double angle : {0.0, 0.5, 1.2}) {
    EXPECT_DOUBLE_EQ(Tracer(scene).radiance({0, 0, 0}, slanted(angle), samples(4))[0], 3.0);
  }
}

// Through a gel the panel loses Fresnel's share at the gel's own face; wetted by the gel it shows all of its light.
TEST(Panel, IsSeenThroughAGelAsFresnelSays) {
  const auto seen = [](bool wet) {
    Scene scene = empty_scene(0.0);
    scene.media = {Medium{1.0, {}}, Medium{1.5, {}}};
    scene.faces = {{0.0, 0, 1}};
    if (!wet) scene.faces.push_back({3.0, 1, 0});
    scene.surfaces.push_back({square_sheet(50.0, 3.0 + 1e-3, false), Emitter{grey(1.0)}});
    return Tracer(scene).radiance({0, 0, -5}, {0, 0, 1}, samples(4096))[0];
  };
  const double face = 0.04;
  EXPECT_NEAR(seen(true), 1.0 - face, 1e-3);
  EXPECT_NEAR(seen(false), (1.0 - face) / (1.0 + face), 1e-3) << "a plate before a panel that reflects nothing";
}

TEST(Surroundings, AreHiddenByADiscAndASphereAsTheirFormFactorsSay) {
  const auto patch_under = [](const Scene& extra) {
    Scene scene = extra;
    scene.surfaces.push_back({square_sheet(0.01, 0.0), Lambertian{grey(0.6)}});
    // A steep ray that passes beside the thing above.
    return Tracer(scene).radiance({-20, 0, 1.0}, Eigen::Vector3d(20, 0, -1.0), samples(16384))[0];
  };
  Scene disc = empty_scene(1.0);
  TriangleMesh mesh;
  mesh.vertices.push_back({0, 0, 2.0});
  constexpr int kCorners = 400;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * kPi * i / kCorners;
    mesh.vertices.push_back({1.5 * std::cos(angle), 1.5 * std::sin(angle), 2.0});
    mesh.triangles.push_back({0, i + 1, (i + 1) % kCorners + 1});
  }
  disc.surfaces.push_back({mesh, Black{}});
  EXPECT_NEAR(patch_under(disc), 0.6 * (1.0 - closed_forms::disc_share(1.5, 2.0)), 1e-3);

  Scene sphere = empty_scene(1.0);
  sphere.balls.push_back({{0, 0, 3.0}, 1.5, Black{}});
  EXPECT_NEAR(patch_under(sphere), 0.6 * (1.0 - closed_forms::sphere_share(1.5, 3.0)), 1e-3);
}

TEST(Interreflection, InAClosedSphereSumsToTheSeries) {
  for (double albedo : {0.3, 0.8}) {
    Scene scene = empty_scene(5.0);  // mustn't get in
    scene.balls.push_back({{0, 0, 0}, 4.0, Lambertian{grey(albedo)}});
    scene.lamps.push_back(half_space_lamp({0, 0, 0}, {0, 0, 1}, 1.0));
    scene.lamps.push_back(half_space_lamp({0, 0, 0}, {0, 0, -1}, 1.0));
    const double expected = closed_forms::sphere_cavity_radiance(albedo, 1.0, 4.0);
    const double seen = Tracer(scene).radiance({1, 0.5, 0.2}, {0.3, 0.5, 0.4}, samples(16384))[0];
    EXPECT_NEAR(seen / expected, 1.0, 0.015) << albedo;
  }
}

TEST(Interreflection, UnderAFlatFaceBrightensAsSaundersonSays) {
  EXPECT_NEAR(closed_forms::internal_diffuse_reflectance(1.41), 0.536, 1e-3);
  for (double albedo : {1.0, 0.6}) {
    Scene scene = empty_scene(1.0);
    scene.media = {Medium{1.0, {}}, Medium{1.41, {}}};
    scene.faces = {{0.0, 0, 1}};
    scene.surfaces.push_back({square_sheet(1000.0, 0.5), Lambertian{grey(albedo)}});
    const double seen = Tracer(scene).radiance({0, 0, -5}, {0, 0, 1}, samples(16384))[0];
    EXPECT_NEAR(seen / closed_forms::covered_plane_radiance(1.41, albedo), 1.0, 0.01) << albedo;
  }
}

TEST(Metal, LampLightAndSurroundingsUseTheSameReflectance) {
  // A metal sheet under a lamp of wide, even light from all sides would equal the furnace: here the reflectance
  // function integrated by paths (surroundings) is compared with its integral by quadrature over lamps.
  const double roughness = 0.4;
  const Eigen::Vector3d eye = slanted(0.6) * 5.0;
  Scene scene = empty_scene(1.0);
  scene.surfaces.push_back({square_sheet(10.0, 0.0), RoughConductor{grey(0.5), roughness}});
  const double by_paths = Tracer(scene).radiance(eye, -eye, samples(16384))[0];

  Scene lit = empty_scene(0.0);
  lit.interreflection = false;
  lit.surfaces = scene.surfaces;
  double by_lamps = 0.0;
  constexpr int kHeights = 24;
  constexpr int kAzimuths = 48;
  const double distance = 100.0;
  for (int i = 0; i < kHeights; ++i) {
    for (int j = 0; j < kAzimuths; ++j) {
      const double z = (i + 0.5) / kHeights;
      const double azimuth = 2.0 * kPi * (j + 0.5) / kAzimuths;
      const double r = std::sqrt(1.0 - z * z);
      const Eigen::Vector3d from(r * std::cos(azimuth), r * std::sin(azimuth), z);
      const double solid_angle = 2.0 * kPi / (kHeights * kAzimuths);
      // Radiance one over this solid angle is an intensity of solid_angle * distance^2 (m^2) there.
      lit.lamps.push_back(half_space_lamp(distance * from, -from, solid_angle * distance * distance * 1e-6));
    }
  }
  by_lamps = Tracer(lit).radiance(eye, -eye, samples(1 << 18))[0];
  EXPECT_NEAR(by_lamps / by_paths, 1.0, 0.01);
}

}  // namespace
}  // namespace touchstone::render
