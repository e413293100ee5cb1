// The choice of a lamp, of a point on its lens and of a ray through hole or stop, by chi-squared.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "render/cameras/lens_camera.h"
#include "render/cameras/pinhole_camera.h"
#include "tests/render/paths/light_scenes.h"
#include "tests/support/chi_squared.h"

namespace touchstone::render {
namespace {

using Point = std::pair<double, double>;

double turn_of(double x, double y) {
  return (std::atan2(y, x) + kPi) / (2.0 * kPi);
}

/// One path along a ray, of its own random numbers.
Spectrum one_path(const Tracer& tracer, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                  std::uint64_t seed) {
  RenderSettings settings = samples(1);
  settings.seed = seed;
  return tracer.radiance(from, direction, settings);
}

// Sixteen bands; each lamp shines in two of them, no two lamps in the same two.
constexpr int kBands = 16;

Spectrum all_bands(double value) {
  return Spectrum::Constant(kBands, value);
}

/// A lamp above z = 0 that looks at the origin with a lobe that falls off, and its number in the bands.
SpotLamp numbered_lamp(int number, const Eigen::Vector3d& position, double power) {
  SpotLamp lamp;
  lamp.position = position;
  lamp.direction = -position;
  lamp.half_angle = 0.02 * (number % 7);
  lamp.soft_angle = 0.8;
  lamp.power_W = all_bands(0.0);
  int first = 0;
  int second = 1;
  for (int i = 0; i < number; ++i) {
    if (++second == kBands) second = ++first + 1;
  }
  lamp.power_W[first] = lamp.power_W[second] = power;
  return lamp;
}

std::pair<int, int> lit_bands(const Spectrum& light) {
  int first = -1;
  int second = -1;
  for (int band = 0; band < kBands; ++band) {
    if (light[band] > 0.0) (first < 0 ? first : second) = band;
  }
  return {first, second};
}

// A path that lamp i lights shows what i alone would send over the chance that i was chosen. So its bands tell which
// lamp it was, its brightness what the tracer takes the chance for; the counts tell whether that is true.
void expect_lamp_choice(Scene scene, std::uint64_t first_seed) {
  const Eigen::Vector3d from(0.5, 0.2, 1.5);
  const Eigen::Vector3d direction(-0.3, 0.1, -1.0);
  scene.environment = all_bands(0.0);
  scene.interreflection = false;
  std::map<std::pair<int, int>, double> alone;
  for (const auto& lamp : scene.lamps) {
    Scene one = scene;
    one.lamps = {lamp};
    const Spectrum light = one_path(Tracer(one), from, direction, 0);
    ASSERT_GT(light.sum(), 0.0);
    alone[lit_bands(light)] = light.sum();
  }
  ASSERT_EQ(alone.size(), scene.lamps.size());
  const Tracer tracer(scene);
  constexpr int kPaths = 50000;
  std::map<std::pair<int, int>, double> counted;
  std::map<std::pair<int, int>, double> chance;
  for (std::uint64_t i = 0; i < kPaths; ++i) {
    const Spectrum light = one_path(tracer, from, direction, first_seed + i);
    const auto bands = lit_bands(light);
    counted[bands] += 1.0;
    chance[bands] = alone[bands] / light.sum();
  }
  ASSERT_EQ(counted.size(), alone.size()) << "a lamp that was never chosen";
  std::vector<double> counts;
  std::vector<double> expected;
  double all = 0.0;
  for (const auto& [bands, count] : counted) {
    counts.push_back(count);
    expected.push_back(chance[bands] * kPaths);
    all += chance[bands];
  }
  EXPECT_NEAR(all, 1.0, 1e-6);
  expect_counts(counts, expected);
}

TEST(LampDensities, ChoiceOverAMattSurface) {
  Scene scene;
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Lambertian{all_bands(0.5)}});
  for (int i = 0; i < 7; ++i) {
    scene.lamps.push_back(numbered_lamp(i, {4.0 * std::cos(i), 4.0 * std::sin(i), 1.0 + 1.3 * i}, 1.0 + 0.4 * (i % 3)));
  }
  expect_lamp_choice(scene, 1);
}

TEST(LampDensities, ChoiceOverMetalUnderAFlatFace) {
  Scene scene;
  scene.media = {Medium{1.0}, Medium{1.5}};
  scene.faces = {{2.0, 1, 0}};
  scene.surfaces.push_back({square_sheet(10.0, 0.0), RoughConductor{all_bands(0.5), 0.8}});
  for (int i = 0; i < 5; ++i) {
    scene.lamps.push_back(numbered_lamp(i, {3.0 * std::cos(i), 3.0 * std::sin(i), 2.5 + i}, 1.0 + i));
  }
  expect_lamp_choice(scene, 100001);
}

TEST(LampDensities, ChoiceAmongForty) {
  Scene scene;
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Lambertian{all_bands(0.5)}});
  for (int i = 0; i < 40; ++i) {
    scene.lamps.push_back(numbered_lamp(i, {3.0 * std::cos(i), 3.0 * std::sin(i), 3.0}, 1.0 + 0.05 * i));
  }
  expect_lamp_choice(scene, 200001);
}

// Before a wide lens stand films of 32 shades, a grid of squares; through which one the light came tells the lens
// point. From far off all points of the lens light the place below alike.
TEST(LampDensities, PointsOfALensAreEven) {
  constexpr int kSide = 6;
  constexpr double kFar = 2e4;
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Lambertian{grey(1.0)}});
  SpotLamp lamp = half_space_lamp({0, 0, kFar}, {0, 0, -1}, 1.0);
  lamp.lens_radius = 1.0;
  const double plain = [&] {
    scene.lamps = {lamp};
    return one_path(Tracer(scene), {0, 0, 1}, {0, 0, -1}, 1)[0];
  }();
  for (int i = 0; i < kSide * kSide; ++i) {
    const double x = 2.0 * (i % kSide) / kSide - 1.0;
    const double y = 2.0 * (i / kSide) / kSide - 1.0;
    TriangleMesh square;
    const double z = kFar - 1.0;
    const double step = 2.0 / kSide;
    square.vertices = {{x, y, z}, {x + step, y, z}, {x + step, y + step, z}, {x, y + step, z}};
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.surfaces.push_back({square, ThinFilm{grey((i + 1.0) / (kSide * kSide)), 1.0, false}});
  }
  const Tracer tracer(scene);
  std::uint64_t seed = 0;
  expect_samples(
      [&]() -> std::optional<Point> {
        const double shade = one_path(tracer, {0, 0, 1}, {0, 0, -1}, ++seed)[0] / plain * kSide * kSide;
        EXPECT_NEAR(shade, std::round(shade), 1e-3);
        const auto i = static_cast<int>(std::round(shade)) - 1;
        return Point((i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide);
      },
      [](double x, double y) { return std::hypot(2.0 * x - 1.0, 2.0 * y - 1.0) < 1.0 ? 4.0 / kPi : 0.0; },
      {kSide, kSide}, 40000, 1e-3);
}

// The area that a ray stands for, summed over the rays through a bin of the hole, is on average the part of the bin
// that both rims leave open. Pearson's statistic with the sums' own variances in place of Poisson's.
TEST(HoleDensities, PinholeBehindAFoil) {
  PinholeCamera camera;
  camera.pixel_pitch_um = 4.0;
  camera.distance_mm = 2.0;
  camera.foil_thickness_um = 60.0;
  const double radius = 0.5e-3 * camera.hole_diameter_um;
  const double reach = 1.3 * radius;
  constexpr int kSide = 13;
  constexpr int kRays = 200000;
  std::uint64_t seed = 300;
  for (double x : {320.0, 430.0, 560.0}) {
    SCOPED_TRACE(x);
    const Eigen::Vector3d sensor(-(x - 320.0) * 0.004, -(300.0 - 240.0) * 0.004, -2.0);
    std::vector<double> sums(kSide * kSide, 0.0);
    std::vector<double> squares(kSide * kSide, 0.0);
    RandomStream stream(++seed, 0, Purpose::kTest);
    for (int i = 0; i < kRays; ++i) {
      const double u = stream.uniform();
      const auto ray = pinhole_ray(camera, x, 300.0, u, stream.uniform());
      const double area = ray->weight * (ray->origin - sensor).squaredNorm() / std::pow(ray->direction.z(), 2);
      const auto column = static_cast<int>(0.5 * kSide * (1.0 + ray->origin.x() / reach));
      const auto row = static_cast<int>(0.5 * kSide * (1.0 + ray->origin.y() / reach));
      ASSERT_TRUE(column >= 0 && column < kSide && row >= 0 && row < kSide);
      sums[row * kSide + column] += area / kRays;
      squares[row * kSide + column] += area * area / kRays;
    }
    const auto open = [&](double a, double b) {
      const Eigen::Vector3d place(reach * (2.0 * a - 1.0), reach * (2.0 * b - 1.0), 0.0);
      const Eigen::Vector3d offset = place - sensor;
      for (double z : {-0.03, 0.03}) {
        if ((place + offset * (z / offset.z())).head<2>().norm() > radius) return 0.0;
      }
      return 4.0 * reach * reach;
    };
    double statistic = 0.0;
    int bins = 0;
    for (int bin = 0; bin < kSide * kSide; ++bin) {
      const double a = static_cast<double>(bin % kSide) / kSide;
      const double b = static_cast<double>(bin / kSide) / kSide;
      const double area = integrate(open, a, a + 1.0 / kSide, b, b + 1.0 / kSide, 1e-9, 9);
      const double variance = (squares[bin] - sums[bin] * sums[bin]) / kRays;
      if (area < 1e-3 * 4.0 * reach * reach / (kSide * kSide)) {
        EXPECT_LT(sums[bin], 2e-3 * 4.0 * reach * reach / (kSide * kSide));
        continue;
      }
      statistic += std::pow(sums[bin] - area, 2) / variance;
      ++bins;
    }
    EXPECT_GT(Eigen::numext::igammac(0.5 * bins, 0.5 * statistic), level_of_one_test())
        << "chi-squared " << statistic << " of " << bins;
  }
}

TEST(HoleDensities, StopOfALens) {
  LensCamera camera;
  camera.width = 64;
  camera.height = 48;
  camera.matrix = matrix_of_lens(4.0, 50.0, 10.0, 64, 48);
  camera.pixel_pitch_um = 10.0;
  camera.aperture_mm = 2.0;
  camera.focus_distance_mm = 50.0;
  const PreparedLens lens = prepare(camera);
  RandomStream stream(310, 0, Purpose::kTest);
  expect_samples(
      [&]() -> std::optional<Point> {
        const double u = stream.uniform();
        const CameraRay ray = lens_ray(lens, 11.3, 7.9, u, stream.uniform());
        return Point(ray.origin.head<2>().squaredNorm(), turn_of(ray.origin.x(), ray.origin.y()));
      },
      [](double, double) { return 1.0; });
}

}  // namespace
}  // namespace touchstone::render
