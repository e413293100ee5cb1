// Ways of light under the coat of a milky slab, against the theory of single scattering and path tracing.

#include "render/membrane/coat_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "core/error.h"
#include "render/cameras/camera_pose.h"
#include "render/membrane/coat_walks.h"
#include "render/paths/path_tracer.h"

namespace touchstone::render {
namespace {

using testing::HasSubstr;

constexpr double kSlabThickness = 2.0;
const Eigen::Vector2d kSlabSize(20.0, 16.0);
constexpr int kArrivalColumns = 5, kArrivalRows = 4;

/// 44 x 33 pixels of 0.25 mm from 20 mm behind the slab.
Camera camera_behind_slab() {
  LensCamera camera;
  camera.width = 44;
  camera.height = 33;
  camera.pixel_pitch_um = 25.0;
  camera.focus_distance_mm = 20.0;
  camera.matrix = matrix_of_lens(1.8, camera.focus_distance_mm, camera.pixel_pitch_um, camera.width, camera.height);
  camera.aperture_mm = 0.5;
  camera.gel_from_camera = look_at({0, 0, -22}, {0, 0, 0}, {0, 1, 0});
  return camera;
}

/// A slab in black walls, on a plate; lamps at two sides. Without a coat. Nothing mirrors: light that the window sends
/// back is no part of walks under a coat.
Scene slab_fixture(double scattering, double anisotropy = 0.0) {
  Scene scene;
  scene.media = {Medium{}, Medium{}, Medium{1.0, flat_spectrum(1, 0.0), flat_spectrum(1, scattering), anisotropy}};
  scene.faces = {{-kSlabThickness - 5.0, 0, 1}, {-kSlabThickness, 1, 2}};
  scene.environment = flat_spectrum(1, 0.0);
  for (const double side : {-1.0, 1.0}) {
    LedLamp led;
    led.position = {side * 9.0, 2.0, -14.0};
    led.direction = Eigen::Vector3d(-side * 9.0, -2.0, 14.0).normalized();
    led.power_W = flat_spectrum(1, 0.01);
    led.radius = 0.3;
    scene.lamps.push_back(led);
  }
  const Eigen::Vector2d half = 0.5 * kSlabSize;
  TriangleMesh walls;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    for (const double z : {-kSlabThickness, 0.0}) walls.vertices.emplace_back(x * half.x(), y * half.y(), z);
  }
  for (int side = 0; side < 4; ++side) {
    const int a = 2 * side;
    const int b = 2 * ((side + 1) % 4);
    walls.triangles.push_back({a, b, a + 1});
    walls.triangles.push_back({b, b + 1, a + 1});
  }
  scene.surfaces.push_back({std::move(walls), Black{}});
  return scene;
}

/// The fixture with a black coat at height(x, y) over the slab's back.
template <typename Height>
Scene under_black(Scene scene, const Height& height) {
  constexpr double kStep = 0.125;
  const int columns = static_cast<int>(std::lround(kSlabSize.x() / kStep));
  const int rows = static_cast<int>(std::lround(kSlabSize.y() / kStep));
  TriangleMesh mesh;
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const double x = (static_cast<double>(i) / columns - 0.5) * kSlabSize.x();
      const double y = (static_cast<double>(j) / rows - 0.5) * kSlabSize.y();
      mesh.vertices.emplace_back(x, y, height(x, y) - kSlabThickness);
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int a = j * (columns + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + columns + 2});
      mesh.triangles.push_back({a, a + columns + 2, a + columns + 1});
    }
  }
  scene.surfaces.push_back({std::move(mesh), Black{}});
  return scene;
}

CoatedSlab milky_slab_of(double scattering, double anisotropy = 0.0) {
  return {.thickness_mm = kSlabThickness,
          .scattering_per_mm = scattering,
          .anisotropy = anisotropy,
          .index = 1.0,
          .index_below = 1.0};
}

CoatLight coat_light(const CoatedSlab& of, const Scene& scene, const CoatWalkSettings& settings = {.drawn = 1 << 15}) {
  const auto arrivals = arrivals_at_back(scene, -kSlabThickness, kSlabSize, kArrivalColumns, kArrivalRows);
  return {walk_under_coat(of, arrivals, settings),
          scene,
          camera_behind_slab(),
          kSlabSize,
          arrivals,
          kArrivalColumns,
          kArrivalRows};
}

cv::Mat flat_coat(const CoatLight& light, double thickness_mm) {
  return {light.grid().rows, light.grid().columns, CV_32FC1, cv::Scalar(thickness_mm)};
}

template <typename Height>
cv::Mat coat_map(const CoatLight& light, const Height& height) {
  cv::Mat map = flat_coat(light, 0.0);
  const FaceGrid& grid = light.grid();
  for (int j = 0; j < map.rows; ++j) {
    for (int i = 0; i < map.cols; ++i) {
      map.at<float>(j, i) = static_cast<float>(
          height(grid.left_mm + (i + 0.5) * grid.spacing_mm, grid.top_mm + (j + 0.5) * grid.spacing_mm));
    }
  }
  return map;
}

/// A ball of 4 mm pressed in by 1.2 mm at (1, -0.5) mm, and a bulge round it.
double ball_dent(double x, double y) {
  constexpr double kRadius = 4.0, kDepth = 1.2;
  const double r = std::hypot(x - 1.0, y + 0.5);
  const double rim = std::sqrt(kDepth * (2.0 * kRadius - kDepth));
  if (r < rim) return kSlabThickness - kDepth + kRadius - std::sqrt(kRadius * kRadius - r * r);
  return kSlabThickness + 0.15 * (r - rim) * std::exp(1.0 - (r - rim));
}

TEST(CoatLight, ACoatWhereItWasTakesNothing) {
  const Scene scene = slab_fixture(0.5);
  const CoatLight light = coat_light(milky_slab_of(0.5), scene);
  const cv::Mat share = light.share(flat_coat(light, kSlabThickness));
  EXPECT_EQ(share.size(), cv::Size(44, 33));
  EXPECT_LT(cv::norm(share, cv::Mat(share.size(), CV_32FC1, cv::Scalar(1.0)), cv::NORM_INF), 1e-6);
}

TEST(CoatLight, AThinSlabGivesBackWhatItScattersOnce) {
  // Straight up by z, and back along a lamp's direction: the light of a layer falls as exp(-s z (1 + 1 / cos)).
  constexpr double kScattering = 0.02;
  const Scene scene = slab_fixture(kScattering);
  const CoatLight light = coat_light(milky_slab_of(kScattering), scene, {.drawn = 1 << 16, .kept = 8192});
  const auto arrivals = arrivals_at_back(scene, -kSlabThickness, kSlabSize, kArrivalColumns, kArrivalRows);
  const auto back = [&](double thickness) {
    double sum = 0.0;
    for (const LampArrival& arrival : arrivals) {
      const double rate = kScattering * (1.0 - 1.0 / arrival.direction.z());
      sum += arrival.irradiance * -std::expm1(-rate * thickness) / rate;
    }
    return sum;
  };
  for (const double part : {0.25, 0.5, 0.75, 1.2}) {
    const double share = cv::mean(light.share(flat_coat(light, part * kSlabThickness)))[0];
    EXPECT_NEAR(share, back(part * kSlabThickness) / back(kSlabThickness), 0.012) << part;
  }
}

TEST(CoatLight, ADentIsAsDarkAsTracedInItsMiddleAndOnItsFlanks) {
  const Camera camera = camera_behind_slab();
  // Pixels by the distance from the ball's middle at (1, -0.5) mm, as if seen straight; 0.25 mm each.
  cv::Mat middle = cv::Mat::zeros(33, 44, CV_8UC1);
  cv::Mat flanks = middle.clone();
  for (int row = 0; row < middle.rows; ++row) {
    for (int column = 0; column < middle.cols; ++column) {
      const double r = std::hypot((column - 21.5) * 0.25 - 1.0, (row - 16.0) * 0.25 + 0.5);
      if (r < 1.6) middle.at<unsigned char>(row, column) = 255;
      if (r >= 1.6 && r < 3.3) flanks.at<unsigned char>(row, column) = 255;
    }
  }
  for (const double anisotropy : {0.0, 0.3}) {
    const double scattering = 0.4 / (1.0 - anisotropy);
    const Scene scene = slab_fixture(scattering, anisotropy);
    const CoatLight light = coat_light(milky_slab_of(scattering, anisotropy), scene, {.drawn = 1 << 16, .kept = 8192});
    const cv::Mat share = light.share(coat_map(light, ball_dent));
    RenderSettings settings;
    settings.min_samples = settings.max_samples = 128;
    const cv::Mat mask = middle | flanks;
    const auto traced = [&](const Scene& coated) { return Tracer(coated).render(camera, settings, mask).irradiance; };
    const cv::Mat rest = traced(under_black(scene, [](double, double) { return kSlabThickness; }));
    const cv::Mat pressed = traced(under_black(scene, ball_dent));
    std::array<double, 2> found{};
    for (int k = 0; k < 2; ++k) {
      const cv::Mat& where = k == 0 ? middle : flanks;
      const double whole = cv::mean(rest, where)[0];
      found[k] = cv::mean(rest.mul(share), where)[0] / whole;
      // The paths' own noise is up to 1 % here.
      EXPECT_NEAR(found[k], cv::mean(pressed, where)[0] / whole, 0.03)
          << anisotropy << (k == 0 ? " middle" : " flanks");
    }
    EXPECT_LT(found[0], 0.65) << "there is something to be seen";
    EXPECT_GT(found[1], found[0] + 0.15);
    EXPECT_GT(cv::sum(share > 1.01)[0], 0.0) << "the bulge is brighter";
  }
}

TEST(CoatLight, SumsDependOnNoThreads) {
  const Scene scene = slab_fixture(0.5);
  const auto picture = [&] {
    const CoatLight light = coat_light(milky_slab_of(0.5), scene);
    return light.share(coat_map(light, ball_dent));
  };
  const cv::Mat many = picture();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(cv::norm(many, picture(), cv::NORM_INF), 0.0);
}

TEST(CoatLight, WhatCantBeIsRefusedByName) {
  const Scene scene = slab_fixture(0.5);
  const auto arrivals = arrivals_at_back(scene, -kSlabThickness, kSlabSize, kArrivalColumns, kArrivalRows);
  const auto refusal = [&](const CoatedSlab& of, const CoatWalkSettings& settings) -> std::string {
    try {
      walk_under_coat(of, arrivals, settings);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(milky_slab_of(0.0), {}), HasSubstr("scattering_per_mm is 0"));
  EXPECT_THAT(refusal(milky_slab_of(0.5, 1.0), {}), HasSubstr("anisotropy is 1"));
  EXPECT_THAT(refusal(milky_slab_of(0.5), {.kept = 0}), HasSubstr("kept is 0"));
  EXPECT_THAT(refusal(milky_slab_of(0.5), {.reach_mm = 0.0}), HasSubstr("reach_mm is 0"));
  Scene dark = scene;
  dark.lamps.clear();
  EXPECT_THROW(arrivals_at_back(dark, -kSlabThickness, kSlabSize, kArrivalColumns, kArrivalRows), Error);
  const CoatLight light = coat_light(milky_slab_of(0.5), scene);
  EXPECT_THROW(light.share(cv::Mat(3, 3, CV_32FC1, cv::Scalar(1.0))), Error);
}

}  // namespace
}  // namespace touchstone::render
