// The choice of a lamp, of a point on its lens and of a ray through hole or stop, by chi-squared.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "light_scenes.h"
#include "render/lens_camera.h"
#include "render/pinhole_camera.h"
#include "tests/support/chi_squared.h"

namespace touchstone::render {
namespace {

using Point = std::pair<double, double>;

double turn_of(double x, double y) {
  return (std::atan2(y, x) + kPi) / (2.0 * kPi);
}

/// One path along a ray, of its own random numbers.
double one_path(const Tracer& tracer, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                std::uint64_t seed) {
  RenderSettings settings = samples(1);
  settings.seed = seed;
  return tracer.radiance(from, direction, settings)[0];
}

// A path that lamp i lights shows what i alone would send over the chance that i was chosen. So the values tell both
// which lamp it was and what the tracer takes its chance for; the counts tell whether that is true.
void expect_lamp_choice(Scene scene, std::uint64_t first_seed) {
  const Eigen::Vector3d from(0.5, 0.2, 3.0);
  const Eigen::Vector3d direction(-0.1, 0.05, -1.0);
  scene.interreflection = false;
  const Tracer tracer(scene);
  std::vector<double> alone;
  for (const SpotLamp& lamp : scene.lamps) {
    Scene one = scene;
    one.lamps = {lamp};
    alone.push_back(one_path(Tracer(one), from, direction, 0));
  }
  constexpr int kPaths = 50000;
  std::map<double, double> counted;
  for (std::uint64_t i = 0; i < kPaths; ++i) counted[one_path(tracer, from, direction, first_seed + i)] += 1.0;
  ASSERT_EQ(counted.size(), alone.size());
  // Which value is whose: chances of all lamps add up to one, and counts follow them; the nearest share settles it.
  std::vector<double> counts;
  std::vector<double> expected;
  double all = 0.0;
  for (const double light : alone) {
    double best = 1e9;
    double count = 0.0;
    double chance = 0.0;
    for (const auto& [value, times] : counted) {
      const double off = std::abs(light / value - times / kPaths);
      if (off < best) {
        best = off;
        count = times;
        chance = light / value;
      }
    }
    counts.push_back(count);
    expected.push_back(chance * kPaths);
    all += chance;
  }
  EXPECT_NEAR(all, 1.0, 1e-9);
  expect_counts(counts, expected);
}

TEST(LampDensities, ChoiceOverAMattSurface) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Lambertian{grey(0.5)}});
  for (int i = 0; i < 7; ++i) {
    const Eigen::Vector3d position(4.0 * std::cos(i), 4.0 * std::sin(i), 1.0 + 1.3 * i);
    SpotLamp lamp = half_space_lamp(position, -position, 1.0 + 0.4 * (i % 3));
    lamp.half_angle = 0.05 * i;  // what falls off in the lobe the choice doesn't know
    lamp.soft_angle = 0.8;
    scene.lamps.push_back(lamp);
  }
  expect_lamp_choice(scene, 1);
}

TEST(LampDensities, ChoiceOverMetal) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(10.0, 0.0), RoughConductor{grey(0.5), 0.8}});
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d position(3.0 * std::cos(i), 3.0 * std::sin(i), 2.0 + i);
    scene.lamps.push_back(half_space_lamp(position, -position, 1.0 + i));
  }
  expect_lamp_choice(scene, 100001);
}

// More lamps than are weighed: all are as likely.
TEST(LampDensities, ChoiceAmongMany) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Lambertian{grey(0.5)}});
  constexpr int kLamps = 40;
  for (int i = 0; i < kLamps; ++i) {
    const Eigen::Vector3d position(3.0 * std::cos(i), 3.0 * std::sin(i), 3.0);
    scene.lamps.push_back(half_space_lamp(position, Eigen::Vector3d(0, 0, -1), 1.0 + i));
  }
  scene.interreflection = false;
  const Tracer tracer(scene);
  std::map<double, double> counted;
  constexpr int kPaths = 40000;
  for (std::uint64_t i = 0; i < kPaths; ++i) counted[one_path(tracer, {0, 0, 2}, {0, 0, -1}, 200001 + i)] += 1.0;
  ASSERT_EQ(counted.size(), kLamps);
  std::vector<double> counts;
  for (const auto& [value, times] : counted) counts.push_back(times);
  expect_counts(counts, std::vector<double>(kLamps, double(kPaths) / kLamps));
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
    return one_path(Tracer(scene), {0, 0, 1}, {0, 0, -1}, 1);
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
        const double shade = one_path(tracer, {0, 0, 1}, {0, 0, -1}, ++seed) / plain * kSide * kSide;
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
      const Eigen::Vector3d way = place - sensor;
      for (double z : {-0.03, 0.03}) {
        if ((place + way * (z / way.z())).head<2>().norm() > radius) return 0.0;
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
