#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "core/units.h"
#include "render/direct/direct_fitness.h"
#include "render/direct/direct_renderer.h"
#include "render/paths/path_tracer.h"
#include "tests/render/direct/direct_scenes.h"

namespace touchstone::render {
namespace {

TEST(DirectRenderer, PointSourceOverAMattPlane) {
  const Eigen::Vector3d lamp(2, 1, -15);
  const Scene scene = plane_scene(lamp);
  const LightField field =
      make_light_field(scene, {Eigen::Vector3d(-9, -9, -0.2), Eigen::Vector3d(9, 9, 0.2)}, accuracy(5e-4));
  const PinholeCamera camera = small_camera(30, 22);
  DirectSettings sharp;
  sharp.blur = false;
  DirectRenderer renderer(field, camera, scene, sharp);
  const DirectImage image = renderer.render(scene);
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const auto ray = pinhole_ray(camera, column + 0.5, row + 0.5, 0.5, 0.5);
      ASSERT_TRUE(ray);
      const Eigen::Vector3d from = camera.gel_from_camera * ray->origin;
      const Eigen::Vector3d along = camera.gel_from_camera.turn(ray->direction);
      const Eigen::Vector3d place = from - along * (from.z() / along.z());
      const Eigen::Vector3d offset = lamp - place;
      // L = rho I cos / (pi r^2), in W and m.
      const double radiance = 0.6 * 2.0 * (-offset.z() / offset.norm()) / (kPi * offset.squaredNorm() * 1e-6);
      EXPECT_NEAR(image.irradiance.at<float>(row, column) / (ray->weight * radiance), 1.0, 3e-3);
    }
  }
  EXPECT_EQ(image.shadow_rays, 0u);  // nothing stands over a plane
  EXPECT_EQ(image.shadow_spared, 30u * 22u);
}

TEST(DirectRenderer, ABallsShadowHasItsOutline) {
  const Eigen::Vector3d lamp(8, 3, -15);
  Scene scene = plane_scene(lamp);
  scene.balls.push_back({{0.5, 0.2, -1.5}, 0.6, Black{}});
  const LightField field =
      make_light_field(scene, {Eigen::Vector3d(-9, -9, -0.2), Eigen::Vector3d(9, 9, 0.2)}, accuracy(2e-3));
  const PinholeCamera camera = small_camera(160, 120);
  DirectSettings sharp;
  sharp.blur = false;
  DirectRenderer renderer(field, camera, scene, sharp);
  const DirectImage image = renderer.render(scene);
  int dark = 0;
  const Ball& ball = scene.balls.front();
  const auto distance_from_line = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = (b - a).normalized();
    return (ball.centre - a - along * along.dot(ball.centre - a)).norm();
  };
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const auto ray = pinhole_ray(camera, column + 0.5, row + 0.5, 0.5, 0.5);
      const Eigen::Vector3d from = camera.gel_from_camera * ray->origin;
      const Eigen::Vector3d along = camera.gel_from_camera.turn(ray->direction);
      const Eigen::Vector3d place = from - along * (from.z() / along.z());
      const double seen = distance_from_line(from, place);
      const double lit = distance_from_line(place, lamp);
      if (std::abs(seen - ball.radius) < 2e-3 || std::abs(lit - ball.radius) < 2e-3) continue;
      const bool expected = seen > ball.radius && lit > ball.radius;
      EXPECT_EQ(image.irradiance.at<float>(row, column) > 0.0f, expected) << column << ", " << row;
      dark += seen > ball.radius && lit < ball.radius ? 1 : 0;
    }
  }
  EXPECT_GT(dark, 30);
}

/// Mean of a direct image against the path tracer's in units of the error, and relative root mean square difference
/// less what noise explains.
void expect_equal_light(const Scene& scene, const char* what) {
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(5e-4));
  const PinholeCamera camera = small_camera(32, 24);
  DirectSettings settings;
  settings.samples = 32;
  settings.seed = 99;
  const cv::Mat direct = DirectRenderer(field, camera, scene, settings).render(scene).irradiance;
  const RenderedImage traced = Tracer(scene).render(camera, samples(128));
  double difference = 0.0;
  double variance = 0.0;
  double squares = 0.0;
  double sum = 0.0;
  double sum2 = 0.0;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const double a = direct.at<float>(row, column);
      const double b = traced.irradiance.at<float>(row, column);
      const double error = traced.standard_error.at<float>(row, column);
      difference += a - b;
      squares += (a - b) * (a - b);
      variance += error * error;
      sum += b;
      sum2 += b * b;
    }
  }
  // The direct image draws from the same pixel, hole and lens areas with a quarter of the samples, but all lamps at
  // each: its own error is taken as the tracer's. The field's interpolation may add its 5e-4.
  EXPECT_LT(std::abs(difference), 4.0 * std::sqrt(2.0 * variance) + 5e-4 * sum) << what << ": means";
  EXPECT_LT(std::sqrt(std::max(0.0, squares - 2.0 * variance) / sum2), 0.015) << what << ": pixels";
  EXPECT_LT(std::sqrt(variance / sum2), 0.03) << what << ": the reference's noise";
}

TEST(DirectRenderer, AgreesWithThePathTracer) {
  expect_equal_light(dented_scene(0.0, Lambertian{grey(0.7)}), "matt");
  expect_equal_light(dented_scene(3.0, Lambertian{grey(0.7)}), "matt, bright room");
  expect_equal_light(dented_scene(0.0, RoughConductor{grey(0.8), 0.5}), "rough metal");
  Scene absorbing = dented_scene(0.0, Lambertian{grey(0.7)});
  absorbing.media[1].absorption = grey(0.02);
  absorbing.media[2].absorption = grey(0.1);
  expect_equal_light(absorbing, "absorbing");
  Scene beads = dented_scene(0.0, Lambertian{grey(0.7)});
  beads.balls.push_back({{1.5, 0.5, -1.1}, 0.25, Lambertian{grey(0.3)}});
  beads.balls.push_back({{-2.0, 1.0, -0.8}, 0.4, Black{}});
  expect_equal_light(beads, "beads");
}

// Facets of a millimetre that are shaded as the curved sheet that they stand for.
TEST(DirectRenderer, AgreesWithThePathTracerOnSmoothSheets) {
  for (const Material& material : {Material{Lambertian{grey(0.7)}}, Material{RoughConductor{grey(0.8), 0.5}}}) {
    Scene scene = lit_stack(0.0);
    const auto ripples = [](double x, double y) { return 0.25 * (std::sin(1.5 * x) * std::cos(1.3 * y) - 1.0); };
    scene.surfaces = {{square_relief(7.0, 14, ripples), material}};
    const cv::Mat facets = Tracer(scene).render(small_camera(32, 24), samples(64)).irradiance;
    scene.surfaces[0].normals = vertex_normals(scene.surfaces[0].mesh);
    const cv::Mat smooth = Tracer(scene).render(small_camera(32, 24), samples(64)).irradiance;
    EXPECT_GT(cv::norm(facets, smooth) / cv::norm(smooth), 0.02) << "then facets would pass, too";
    expect_equal_light(scene, "smooth");
  }
}

TEST(DirectRenderer, AgreesWithThePathTracerUnderLedAndAreaLamps) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  LedLamp led;
  led.position = {-10, 12, -18};
  led.direction = Eigen::Vector3d(0, 0, -1) - led.position;
  led.radius = 0.9;
  led.half_power_angle = 0.5;
  led.power_W = grey(1.0);
  AreaLamp area;
  area.centre = {14, 0, -16};
  area.direction = -area.centre;
  area.along = {0, 1, 0};
  area.width = 3.0;
  area.power_W = grey(1.0);
  scene.lamps = {led, area};
  expect_equal_light(scene, "LED and area");

  led.visible = true;
  scene.lamps = {led};
  EXPECT_THROW(make_light_field(scene, reach_of_membrane(), accuracy(5e-3)), Error);
}

/// Upright walls from the gel's floor to z = 0, `half` mm before the middle on all four sides.
TriangleMesh walls_round(double half) {
  TriangleMesh mesh;
  for (const double z : {-5.0, 0.0}) {
    for (const auto& [x, y] : {std::pair{-half, -half}, {half, -half}, {half, half}, {-half, half}}) {
      mesh.vertices.emplace_back(x, y, z);
    }
  }
  for (int k = 0; k < 4; ++k) {
    const int next = (k + 1) % 4;
    mesh.triangles.push_back({k, next, 4 + next});
    mesh.triangles.push_back({k, 4 + next, 4 + k});
  }
  return mesh;
}

// Seen along z light runs straight, so walls hide no lamp that stands within them: the membrane alone casts
// shadows, and no ray asks for them. A ball far aside makes it one of several things that may.
TEST(DirectRenderer, WallsHideNoLampWithinThem) {
  Scene scene = lit_stack(0.0);
  const auto dents = [](double x, double y) {
    double z = 0.0;
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, {3.0, 0.0}, {-3.0, 0.0}, {0.0, 3.0}, {0.0, -3.0}, {3.0, 3.0}}) {
      z -= 1.4 * std::exp(-((x - u) * (x - u) + (y - v) * (y - v)) / 1.2);
    }
    return z;
  };
  scene.surfaces.push_back({square_relief(7.0, 140, dents), Lambertian{grey(0.7)}});
  scene.media[1].index = scene.media[2].index;  // flat light isn't mirrored back into the plate
  LedLamp led;
  led.position = {-6.6, 0.5, -5.8};
  led.direction = {1, 0, 0.3};
  led.radius = 0.3;
  led.power_W = grey(1.0);
  scene.lamps = {led};
  led.position = {1.0, 6.5, -5.8};
  led.direction = {0, -1, 0.3};
  scene.lamps.push_back(led);
  scene.surfaces.push_back({walls_round(7.0), Black{}});
  expect_equal_light(scene, "LEDs within walls");

  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(2e-3));
  const PinholeCamera camera = small_camera(96, 72);
  const DirectImage alone = DirectRenderer(field, camera, scene).render(scene);
  EXPECT_EQ(alone.shadow_rays, 0u);
  DirectSettings bare;
  bare.shadows = false;
  const cv::Mat without = DirectRenderer(field, camera, scene, bare).render(scene).irradiance;
  const double in_shadow = cv::norm(without - alone.irradiance);
  EXPECT_GT(in_shadow, 0.03 * cv::norm(without)) << "no shadow that matters";
  scene.balls.push_back({{6.5, -6.5, -0.5}, 0.01, Black{}});
  const DirectImage by_rays = DirectRenderer(field, camera, scene).render(scene);
  EXPECT_GT(by_rays.shadow_rays, 0u);
  EXPECT_LT(cv::norm(by_rays.irradiance - alone.irradiance), 0.2 * in_shadow);
  scene.balls.clear();

  // Walls between lamp and membrane do hide it.
  std::get<LedLamp>(scene.lamps[0]).position.x() = -7.8;
  const LightField beyond = make_light_field(scene, reach_of_membrane(), accuracy(2e-3));
  expect_equal_light(scene, "an LED beyond a wall");
  Scene open = scene;
  open.surfaces.pop_back();
  const cv::Mat behind_wall = DirectRenderer(beyond, camera, scene).render(scene).irradiance;
  const cv::Mat in_the_open = DirectRenderer(beyond, camera, open).render(open).irradiance;
  EXPECT_GT(cv::norm(in_the_open - behind_wall), 0.03 * cv::norm(in_the_open)) << "no wall that matters";
}

TEST(DirectRenderer, BandsAreIndependent) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  scene.media[2].absorption = grey(0.1);
  const PinholeCamera camera = small_camera(16, 12);
  const auto picture = [&](const Scene& of) {
    const LightField field = make_light_field(of, reach_of_membrane(), accuracy(1e-2));
    return DirectRenderer(field, camera, of).render(of).irradiance;
  };
  const cv::Mat one = picture(scene);
  constexpr int kBands = 16;
  Scene many = scene;
  many.environment = flat_spectrum(kBands, 0.0);
  many.surfaces[0].material = Lambertian{flat_spectrum(kBands, 0.7)};
  for (Lamp& each : many.lamps) {
    auto& lamp = std::get<SpotLamp>(each);
    lamp.power_W = flat_spectrum(kBands, 0.5);
    lamp.power_W[5] = 1.0;
  }
  many.media[2].absorption = flat_spectrum(kBands, 0.1);
  const cv::Mat all = picture(many);
  ASSERT_EQ(all.type(), CV_32FC(kBands));
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const float* bands = all.ptr<float>(row) + kBands * column;
      const float expected = one.at<float>(row, column);
      for (int band = 0; band < kBands; ++band) {
        EXPECT_NEAR(bands[band], (band == 5 ? 2.0f : 1.0f) * expected, 1e-5f * expected + 1e-12f);
      }
    }
  }
}

TEST(DirectRenderer, SameBytesForAnyThreadsAndHistory) {
  const Scene rest = [] {
    Scene scene = lit_stack(1.0);
    scene.surfaces.push_back({square_relief(7.0, 70, [](double, double) { return 0.0; }), Lambertian{grey(0.7)}});
    return scene;
  }();
  Scene dented = rest;
  dented.surfaces[0].mesh = square_relief(7.0, 70, dent);
  Scene finer = rest;
  finer.surfaces[0].mesh = square_relief(7.0, 50, dent);
  const PinholeCamera camera = small_camera(50, 38);
  const auto picture = [&](int threads, bool history) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const LightField field = make_light_field(rest, reach_of_membrane(), accuracy(5e-3));
    DirectRenderer renderer(field, camera, rest);
    if (history) {
      renderer.render(finer);
      renderer.render(rest);
    }
    return renderer.render(dented).irradiance;
  };
  const cv::Mat one = picture(1, false);
  for (const cv::Mat& other : {picture(3, false), picture(4, true)}) {
    EXPECT_EQ(cv::norm(one, other, cv::NORM_INF), 0.0);
  }
  EXPECT_GT(cv::sum(one)[0], 0.0);
}

TEST(DirectRenderer, RefusesOtherScenes) {
  const Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-2));
  const PinholeCamera camera = small_camera(8, 6);
  EXPECT_EQ(unfit_for_direct(field, scene), "");
  DirectRenderer renderer(field, camera, scene);
  const auto refuses = [&](auto change) {
    Scene other = scene;
    change(other);
    EXPECT_THROW(renderer.render(other), Error);
  };
  refuses([](Scene& s) { s.interreflection = true; });
  refuses([](Scene& s) { std::get<SpotLamp>(s.lamps[0]).power_W = grey(0.6); });
  refuses([](Scene& s) { s.media[2].index = 1.5; });
  refuses([](Scene& s) { s.surfaces[0].material = Refractive{2, 0}; });
  refuses([](Scene& s) { s.media[2].scattering = grey(0.1); });
  refuses([](Scene& s) {
    Print print;
    s.surfaces[0].print = print;  // without material coordinates
  });
  refuses([](Scene& s) {
    Print print;
    for (const Eigen::Vector3d& v : s.surfaces[0].mesh.vertices) print.material_mm.emplace_back(v.head<2>());
    print.picture = std::make_shared<const PrintedPicture>();  // of no pixels
    s.surfaces[0].print = print;
  });
  refuses([](Scene& s) { s.surfaces[0].mesh.vertices[0].z() = -6.0; });  // in the glass
  refuses([](Scene& s) { s.surfaces[0].mesh.vertices[0].x() = -8.0; });  // beside the box
  refuses([](Scene& s) { s.surfaces[0].mesh.vertices[0].x() = std::nan(""); });
  refuses([](Scene& s) { s.balls.push_back({{0, 0, -2}, 1.0, Lambertian{grey(0.5)}}); });  // out of the box
  DirectSettings bad;
  bad.samples = 0;
  EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  bad.samples = 1;
  bad.edge_side = 3;
  EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  bad.edge_side = 2;
  bad.edge_contrast = -1.0;
  EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  bad.edge_contrast = 0.1;
  for (double rays : {0.0, 65.0, std::numeric_limits<double>::quiet_NaN()}) {
    bad.rays_across_blur = rays;
    EXPECT_THROW(DirectRenderer(field, camera, scene, bad), Error);
  }
  PinholeCamera blind = camera;
  blind.distance_mm = 0.0;
  EXPECT_THROW(DirectRenderer(field, blind, scene), Error);
}

TEST(DirectRenderer, APrintedPictureIsItsColours) {
  const Scene plain = dented_scene(0.0, Lambertian{grey(0.7)});
  const Scene darker = dented_scene(0.0, Lambertian{grey(0.35)});
  Scene printed = plain;
  Print print;
  for (const Eigen::Vector3d& v : printed.surfaces[0].mesh.vertices) print.material_mm.emplace_back(v.head<2>());
  print.picture = std::make_shared<const PrintedPicture>(PrintedPicture{1, 1, {-50, -50}, {100, 100}, 1, {0.35f}});
  printed.surfaces[0].print = print;
  const LightField field = make_light_field(plain, reach_of_membrane(), accuracy(1e-2));
  DirectRenderer renderer(field, small_camera(8, 6), plain);
  const cv::Mat expected = renderer.render(darker).irradiance;
  EXPECT_GT(cv::norm(expected), 0.0);
  EXPECT_LE(cv::norm(renderer.render(printed).irradiance, expected, cv::NORM_INF), 1e-6 * cv::norm(expected));
}

}  // namespace
}  // namespace touchstone::render
