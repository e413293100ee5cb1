// Pixels at the rim of a shadow, sampled until they are good enough: no darker and no brighter than they should be.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "core/units.h"
#include "light_scenes.h"

namespace touchstone::render {
namespace {

// A disc lamp, of radius 1 if not said otherwise, stands 20 above a matt plane, an edge along y 10 below it; so the
// penumbra is a band of x from -1 to 1, and at x the edge hides the disc's part beyond -x.
Scene edge_under_a_lamp(double lens_radius = 1.0) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(30.0, 0.0), Lambertian{grey(0.5)}});
  TriangleMesh screen;
  screen.vertices = {{-30, -30, 10}, {0, -30, 10}, {0, 30, 10}, {-30, 30, 10}};
  screen.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.surfaces.push_back({screen, Black{}});
  SpotLamp lamp = half_space_lamp({0, 0, 20}, {0, 0, -1}, 1.0);
  lamp.lens_radius = lens_radius;
  scene.lamps.push_back(lamp);
  return scene;
}

/// Share of the disc that shines past the edge to x.
double share_lit(double x) {
  if (x >= 1.0) return 1.0;
  if (x <= -1.0) return 0.0;
  return 1.0 - (std::acos(x) - x * std::sqrt(1.0 - x * x)) / kPi;
}

// A row of small pixels, each seeing a point of the plane, looks along x from below the screen.
PinholeCamera low_camera() {
  PinholeCamera camera;
  camera.width = 120;
  camera.height = 12;
  camera.pixel_pitch_um = 30.0;
  camera.distance_mm = 4.0;
  camera.hole_diameter_um = 1.0;
  camera.foil_thickness_um = 0.0;
  camera.gel_from_camera = look_at({0, 0, 4}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

/// x on the plane that a column sees.
double place_of(const PinholeCamera& camera, int column) {
  return -(column + 0.5 - 0.5 * camera.width) * camera.pixel_pitch_um * 1e-3;  // the plane is as far as the sensor
}

RenderSettings adaptive(double electrons_per_irradiance, double read_noise_e, std::uint64_t seed) {
  RenderSettings settings;
  settings.seed = seed;
  settings.min_samples = 8;
  settings.max_samples = 256;
  settings.noise = NoiseTarget{grey(electrons_per_irradiance), read_noise_e, 0.0, 1.0};
  return settings;
}

// Most pixels of the penumbra's outer parts see no light, or no shadow, in their first eight samples.
TEST(Penumbra, IsAsBrightAsTheVisibleShareOfTheLamp) {
  const PinholeCamera camera = low_camera();
  const Scene scene = edge_under_a_lamp();
  Scene open = scene;
  open.surfaces.pop_back();
  const cv::Mat bright = Tracer(open).render(camera, samples(64)).irradiance;
  const double middle = bright.at<float>(6, 60);
  constexpr double kElectrons = 5000.0;
  constexpr double kReadNoise = 3.0;
  const Tracer tracer(scene);
  std::vector<double> sums(camera.width, 0.0);
  double squares = 0.0;
  double largest = 0.0;
  int pixels = 0;
  constexpr int kSeeds = 6;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const RenderedImage image = tracer.render(camera, adaptive(kElectrons / middle, kReadNoise, 100 + seed));
    for (int column = 0; column < camera.width; ++column) {
      const double expected = share_lit(place_of(camera, column));
      for (int row = 0; row < camera.height; ++row) {
        const double off = double(image.irradiance.at<float>(row, column)) / bright.at<float>(row, column) - expected;
        sums[column] += off / (kSeeds * camera.height);
        if (expected <= 0.0 || expected >= 1.0) continue;
        const double noise = std::sqrt(kElectrons * expected + kReadNoise * kReadNoise) / kElectrons;
        squares += off * off / (noise * noise);
        largest = std::max(largest, std::abs(off) / noise);
        ++pixels;
      }
    }
  }
  EXPECT_LT(std::sqrt(squares / pixels), 1.2) << "asked for: 1; 6.1 where the first samples decide";
  EXPECT_LT(largest, 8.0);
  double all = 0.0;
  for (int column = 0; column < camera.width; ++column) {
    // A mean of 72 pixels, each good to 0.014 at most.
    EXPECT_NEAR(sums[column], 0.0, 0.015) << "at " << place_of(camera, column);
    all += sums[column] / camera.width;
  }
  EXPECT_NEAR(all, 0.0, 1e-3);
}

// Where no rim is near, neither light nor shadow takes more than the first samples. The lens is narrower here.
TEST(Penumbra, FarFromItPixelsStopAtOnce) {
  const PinholeCamera camera = low_camera();
  const Scene scene = edge_under_a_lamp(0.2);
  const RenderedImage image = Tracer(scene).render(camera, adaptive(1e9, 3.0, 1));
  for (int column = 0; column < camera.width; ++column) {
    if (std::abs(place_of(camera, column)) < 0.5) continue;
    for (int row = 0; row < camera.height; ++row) EXPECT_EQ(image.samples.at<int>(row, column), 8) << column;
  }
  EXPECT_GT(cv::mean(image.samples.colRange(56, 64))[0], 100.0);
}

}  // namespace
}  // namespace touchstone::render
