// Under surroundings of radiance one all that takes nothing away looks one: no energy is made or lost.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/random.h"
#include "light_scenes.h"

namespace touchstone::render {
namespace {

/// A gently bumpy gel surface, normal up.
TriangleMesh bumpy_sheet(double half, int cells, double amplitude) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const double x = half * (2.0 * i / cells - 1.0);
      const double y = half * (2.0 * j / cells - 1.0);
      mesh.vertices.push_back({x, y, amplitude * std::sin(0.9 * x) * std::cos(1.1 * y)});
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i;
      const int b = a + cells + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  return mesh;
}

/// Mean radiance over rays from below the stack, spread over the scene.
double mean_view(const Scene& scene, int rays, int samples_each) {
  const Tracer tracer(scene);
  RandomStream stream(21, 0, Purpose::kTest);
  double sum = 0.0;
  for (int i = 0; i < rays; ++i) {
    const Eigen::Vector3d from(4.0 * stream.uniform() - 2.0, 4.0 * stream.uniform() - 2.0, -27.0);
    const Eigen::Vector3d to(4.0 * stream.uniform() - 2.0, 4.0 * stream.uniform() - 2.0, -0.5);
    RenderSettings settings = samples(samples_each);
    settings.seed = static_cast<std::uint64_t>(i);
    sum += tracer.radiance(from, to - from, settings)[0];
  }
  return sum / rays;
}

TEST(WhiteFurnace, WhiteBallsInAirReturnOne) {
  Scene scene = empty_scene(1.0);
  scene.balls.push_back({{0.3, 0, -0.5}, 2.0, Lambertian{grey(1.0)}});
  EXPECT_NEAR(mean_view(scene, 50, 16), 1.0, 1e-12);  // a convex white thing: each path, not only the mean
}

TEST(WhiteFurnace, StackWithBeadsAndGlassBallsReturnsOne) {
  Scene scene = sensor_stack(1.0);
  scene.media.push_back(Medium{1.7, {}});
  scene.surfaces.push_back({bumpy_sheet(10.0, 40, 0.05), Refractive{2, 0}});
  scene.balls.push_back({{-1, 0, -1.5}, 0.8, Lambertian{grey(1.0)}});
  scene.balls.push_back({{1, 0.4, -1.5}, 0.8, Refractive{3, 2}});
  scene.balls.push_back({{0, -1.5, -1.5}, 0.5, Refractive{0, 2}});  // a bubble
  scene.surfaces.push_back({square_sheet(1.5, 0.8, false), Lambertian{grey(1.0)}});
  EXPECT_NEAR(mean_view(scene, 400, 64), 1.0, 2e-3);
}

TEST(WhiteFurnace, WetContactReturnsOne) {
  Scene scene = sensor_stack(1.0);
  TriangleMesh surface = bumpy_sheet(10.0, 20, 0.0);
  std::erase_if(surface.triangles, [&](const auto& t) { return surface.vertices[t[0]].norm() < 3.0; });
  scene.surfaces.push_back({surface, Refractive{2, 0}});
  scene.surfaces.push_back({square_sheet(4.0, 1e-3, false), Lambertian{grey(1.0)}});
  EXPECT_NEAR(mean_view(scene, 400, 64), 1.0, 3e-3);
}

TEST(WhiteFurnace, WhiteMetalReturnsOne) {
  for (double roughness : {0.02, 0.1, 0.3, 0.6, 1.0}) {
    Scene scene = empty_scene(1.0);
    scene.balls.push_back({{0, 0, -0.5}, 2.5, RoughConductor{grey(1.0), roughness}});
    EXPECT_NEAR(mean_view(scene, 200, 64), 1.0, 5e-3) << roughness;
  }
}

TEST(WhiteFurnace, CameraInsideTheGelSeesOne) {
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Refractive{2, 0}});
  PinholeCamera camera = small_camera(8, 6);
  camera.gel_from_camera = look_at({0, 0, -4}, {0, 0, 0}, {0, 1, 0});
  const cv::Mat inside = Tracer(scene).render(camera, samples(64)).irradiance;
  const cv::Mat air = Tracer(empty_scene(1.0)).render(camera, samples(64)).irradiance;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 8; ++column) {  // radiance is n^2 times that in air
      EXPECT_NEAR(inside.at<float>(row, column) / air.at<float>(row, column), 1.41 * 1.41, 0.03);
    }
  }
}

TEST(Darkness, NoLightIsZero) {
  Scene scene = sensor_stack(0.0);
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Refractive{2, 0}});
  scene.surfaces.push_back({square_sheet(5.0, 0.5, false), Lambertian{grey(1.0)}});
  SpotLamp off = half_space_lamp({0, 0, -20}, {0, 0, 1}, 0.0);
  scene.lamps.push_back(off);
  const cv::Mat image = Tracer(scene).render(small_camera(16, 12), samples(16)).irradiance;
  EXPECT_EQ(cv::countNonZero(image), 0);
}

TEST(Darkness, BlackSceneIsZero) {
  Scene scene = sensor_stack(0.0);
  scene.surfaces.push_back({square_sheet(100.0, 0.0), Black{}});
  scene.balls.push_back({{0, 0, -1}, 0.5, Lambertian{grey(0.0)}});
  scene.lamps.push_back(half_space_lamp({0, 0, -20}, {0, 0, 1}, 1.0));
  const cv::Mat image = Tracer(scene).render(small_camera(16, 12), samples(16)).irradiance;
  EXPECT_EQ(cv::countNonZero(image), 0);
}

}  // namespace
}  // namespace touchstone::render
