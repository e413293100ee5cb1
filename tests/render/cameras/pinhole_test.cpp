// The pinhole's fall-off and orientation, on rendered images.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "closed_forms/light_closed_forms.h"
#include "core/units.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

PinholeCamera wide_camera(double foil_um) {
  PinholeCamera camera;
  camera.width = 61;
  camera.height = 41;
  camera.pixel_pitch_um = 120.0;
  camera.distance_mm = 5.0;
  camera.hole_diameter_um = 100.0;
  camera.foil_thickness_um = foil_um;
  return camera;
}

TEST(PinholeImage, FallsOffAsCosineToTheFourthAndTheFoilSay) {
  const Tracer tracer(empty_scene(3.0));
  for (double foil : {0.0, 50.0}) {
    // Far behind the hole: the closed form takes light from a pixel to both rims as parallel, good to foil / distance.
    PinholeCamera camera = wide_camera(foil);
    camera.distance_mm *= 20.0;
    camera.pixel_pitch_um *= 20.0;
    const cv::Mat image = tracer.render(camera, samples(256)).irradiance;
    for (int row = 0; row < camera.height; row += 5) {
      for (int column = 0; column < camera.width; column += 5) {
        double expected = 0.0;  // mean over the pixel
        for (int i = 0; i < 64; ++i) {
          const double x = 0.12 * (column + (i % 8 + 0.5) / 8 - 30.5);
          const double y = 0.12 * (row + (i / 8 + 0.5) / 8 - 20.5);
          const double angle = std::atan(std::hypot(x, y) / 5.0);
          expected += closed_forms::pinhole_irradiance(3.0, 0.1, 100.0, angle, foil * 1e-3) / 64;
        }
        EXPECT_NEAR(image.at<float>(row, column) / expected, 1.0, 2e-3) << "foil " << foil << " column " << column;
      }
    }
  }
}

TEST(PinholeImage, At30DegreesAFoilOfHalfTheHoleLeaves36Percent) {
  const double centre = closed_forms::pinhole_irradiance(1.0, 0.1, 5.0, 0.0, 0.05);
  EXPECT_NEAR(closed_forms::pinhole_irradiance(1.0, 0.1, 5.0, kPi / 6.0, 0.05) / centre, 0.359, 1e-3);
  EXPECT_NEAR(closed_forms::pinhole_irradiance(1.0, 0.1, 5.0, kPi / 6.0, 0.0) / centre, 0.5625, 1e-9);
}

// Far off the axis the two rims leave a lens of the hole open. Drawn uniformly over it a sample's weight varies only
// with the path's own length and slant.
TEST(PinholeRay, WeightHardlyVariesOverTheHole) {
  const PinholeCamera camera = wide_camera(50.0);
  for (double x : {30.5, 45.0, 54.0}) {  // 0, 19 and 29 degrees
    double sum = 0.0;
    double squares = 0.0;
    constexpr int kSide = 200;
    for (int i = 0; i < kSide * kSide; ++i) {
      const auto ray = pinhole_ray(camera, x, 20.5, (i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide);
      ASSERT_TRUE(ray);
      sum += ray->weight;
      squares += ray->weight * ray->weight;
    }
    const double mean = sum / (kSide * kSide);
    EXPECT_LT(std::sqrt(std::max(0.0, squares / (kSide * kSide) - mean * mean)) / mean, 0.015) << x;
    const double angle = std::atan(0.12 * std::abs(x - 30.5) / 5.0);
    EXPECT_NEAR(mean / closed_forms::pinhole_irradiance(1.0, 0.1, 5.0, angle, 0.05), 1.0, 0.012)
        << "good to foil / distance";
  }
}

TEST(PinholeImage, AThickFoilHidesTheCorners) {
  PinholeCamera camera = wide_camera(400.0);
  const cv::Mat image = Tracer(empty_scene(1.0)).render(camera, samples(16)).irradiance;
  EXPECT_GT(image.at<float>(20, 30), 0.0f);
  EXPECT_EQ(image.at<float>(0, 0), 0.0f);  // beyond tan = 1/4 nothing passes
  EXPECT_EQ(image.at<float>(20, 60), 0.0f);
}

TEST(PinholeImage, IsUprightAndWhereProjectSays) {
  // A dark ball right of and below the axis, in the camera's frame, before bright surroundings.
  Scene scene = empty_scene(1.0);
  PinholeCamera camera = small_camera(60, 40);
  const Eigen::Vector3d in_camera(3.0, 1.5, 20.0);
  scene.balls.push_back({camera.gel_from_camera * in_camera, 0.6, Black{}});
  const cv::Mat with = Tracer(scene).render(camera, samples(1024)).irradiance;
  const cv::Mat without = Tracer(empty_scene(1.0)).render(camera, samples(1024)).irradiance;
  Eigen::Vector2d centroid(0, 0);
  double weight = 0.0;
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 60; ++column) {
      const double missing = 1.0 - with.at<float>(row, column) / without.at<float>(row, column);
      centroid += missing * Eigen::Vector2d(column + 0.5, row + 0.5);
      weight += missing;
    }
  }
  centroid /= weight;
  const Eigen::Vector2d expected = project(camera, in_camera);
  EXPECT_GT(expected.x(), 40.0);
  EXPECT_GT(expected.y(), 25.0);
  EXPECT_NEAR((centroid - expected).norm(), 0.0, 0.03);
}

TEST(PinholeImage, OnePixelSensorIsThePlainMean) {
  PinholeCamera camera = wide_camera(0.0);
  camera.width = camera.height = 1;
  camera.pixel_pitch_um = 10.0;
  const RenderedImage image = Tracer(empty_scene(2.0)).render(camera, samples(64));
  EXPECT_NEAR(image.irradiance.at<float>(0, 0), closed_forms::pinhole_irradiance(2.0, 0.1, 5.0, 0.0, 0.0),
              1e-3 * 2.0 * 3e-4);
  EXPECT_EQ(image.samples.at<int>(0, 0), 64);
  EXPECT_EQ(image.counts.paths, 64u);
}

}  // namespace
}  // namespace touchstone::render
