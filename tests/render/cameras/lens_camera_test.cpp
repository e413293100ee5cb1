// The thin lens: irradiance, focus, distortion.

#include "render/cameras/lens_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// 4 mm lens of f/2, sharp at 50 mm, with a wide picture.
LensCamera wide_lens() {
  LensCamera camera;
  camera.width = 64;
  camera.height = 48;
  camera.pixel_pitch_um = 100.0;
  camera.aperture_mm = 2.0;
  camera.focus_distance_mm = 50.0;
  camera.matrix = matrix_of_lens(4.0, 50.0, 100.0, 64, 48);
  return camera;
}

/// What calibrations of webcams look like, off centre and with pixels that aren't quite square.
LensCamera calibrated_lens() {
  LensCamera camera;
  camera.width = 640;
  camera.height = 480;
  camera.matrix = {812.3, 808.9, 331.7, 226.4};
  camera.distortion = {-0.31, 0.12, 1.1e-3, -0.8e-3, -0.02};
  camera.pixel_pitch_um = 5.6;
  camera.aperture_mm = 1.8;
  camera.focus_distance_mm = 40.0;
  return camera;
}

/// Mean weight over the lens, by the midpoint rule.
double irradiance_per_radiance(const PreparedLens& camera, double x, double y, int side = 64) {
  double sum = 0.0;
  for (int i = 0; i < side * side; ++i) {
    sum += lens_ray(camera, x, y, (i % side + 0.5) / side, (i / side + 0.5) / side).weight;
  }
  return sum / (side * side);
}

/// pi times the form factor of a disc of radius r seen from a point at distance h from its plane and a from its axis.
double disc_irradiance(double r, double h, double a) {
  const double sum = a * a + h * h + r * r;
  return 0.5 * kPi * (1.0 - (a * a + h * h - r * r) / std::sqrt(sum * sum - 4.0 * a * a * r * r));
}

TEST(LensIrradiance, IsThatOfTheDiscThatASensorPointSees) {
  for (double aperture : {0.02, 1.0, 3.0}) {
    LensCamera camera = wide_lens();
    camera.aperture_mm = aperture;
    const PreparedLens lens = prepare(camera);
    const double v = sensor_distance_mm(camera);
    for (double x : {32.0, 45.0, 64.0}) {
      for (double y : {24.0, 3.0}) {
        const double off = 0.1 * std::hypot(x - 32.0, y - 24.0);
        const double expected = disc_irradiance(aperture / 2.0, v, off);
        EXPECT_NEAR(irradiance_per_radiance(lens, x, y) / expected, 1.0, aperture > 2.0 ? 2e-4 : 3e-5)
            << aperture << " mm at " << x << ", " << y;
      }
    }
  }
}

TEST(LensIrradiance, OfASmallStopFallsOffAsCosineToTheFourth) {
  LensCamera camera = wide_lens();
  camera.aperture_mm = 0.01;
  const PreparedLens lens = prepare(camera);
  const double v = sensor_distance_mm(camera);
  EXPECT_NEAR(v, 1.0 / (1.0 / 4.0 - 1.0 / 50.0), 1e-12);
  for (double x : {32.0, 40.0, 52.5, 64.0}) {
    const double cosine = v / std::hypot(v, 0.1 * (x - 32.0));
    const double expected = kPi / 4.0 * std::pow(0.01 / v, 2) * std::pow(cosine, 4);
    EXPECT_NEAR(irradiance_per_radiance(lens, x, 24.0) / expected, 1.0, 1e-5) << x;
  }
}

TEST(LensIrradiance, OfARenderedPictureIsAbsolute) {
  const LensCamera camera = wide_lens();
  const cv::Mat image = Tracer(empty_scene(3.0)).render(camera, samples(256)).irradiance;
  const double v = sensor_distance_mm(camera);
  for (int row = 0; row < 48; row += 7) {
    for (int column = 0; column < 64; column += 7) {
      const double off = 0.1 * std::hypot(column + 0.5 - 32.0, row + 0.5 - 24.0);
      EXPECT_NEAR(image.at<float>(row, column) / (3.0 * disc_irradiance(1.0, v, off)), 1.0, 2e-3);
    }
  }
}

// The light of a field of view is the same wherever distortion puts it.
TEST(LensIrradiance, DistortionMovesLightAndLosesNone) {
  LensCamera camera = wide_lens();
  camera.distortion = {-0.15, 0.02, 2e-3, -1e-3, 0.0};
  const PreparedLens bent = prepare(camera);
  camera.distortion = {};
  const PreparedLens straight = prepare(camera);
  // The flux through a small square of the field of view, by both methods.
  for (double a : {0.0, 0.2, 0.5}) {
    const Eigen::Vector2d tangents(a, 0.3 * a);
    const auto flux = [&](const PreparedLens& lens) {
      constexpr double kHalf = 1e-4;
      const Eigen::Vector2d at = project(lens, {tangents.x(), tangents.y(), 1.0});
      const Eigen::Vector2d right = project(lens, {tangents.x() + kHalf, tangents.y(), 1.0}) -
                                    project(lens, {tangents.x() - kHalf, tangents.y(), 1.0});
      const Eigen::Vector2d down = project(lens, {tangents.x(), tangents.y() + kHalf, 1.0}) -
                                   project(lens, {tangents.x(), tangents.y() - kHalf, 1.0});
      const double area = right.x() * down.y() - right.y() * down.x();
      return area * irradiance_per_radiance(lens, at.x(), at.y(), 16);
    };
    EXPECT_NEAR(flux(bent) / flux(straight), 1.0, 1e-6) << a;
  }
}

/// The image point whose ray through (u, v) of the lens meets `point`.
Eigen::Vector2d image_of(const PreparedLens& lens, const Eigen::Vector3d& point, double u, double v) {
  const auto at_depth = [&](const Eigen::Vector2d& pixel) {
    const CameraRay ray = lens_ray(lens, pixel.x(), pixel.y(), u, v);
    const Eigen::Vector3d hit = ray.origin + ray.direction * (point.z() / ray.direction.z());
    return Eigen::Vector2d(hit.x(), hit.y());
  };
  Eigen::Vector2d pixel = project(lens, point);
  for (int step = 0; step < 20; ++step) {
    const Eigen::Vector2d here = at_depth(pixel);
    Eigen::Matrix2d slope;
    slope.col(0) = at_depth(pixel + Eigen::Vector2d(1e-3, 0)) - here;
    slope.col(1) = at_depth(pixel + Eigen::Vector2d(0, 1e-3)) - here;
    pixel += 1e-3 * (slope.inverse() * (point.head<2>() - here));
  }
  return pixel;
}

TEST(LensFocus, APointInThePlaneOfFocusIsAPoint) {
  for (const LensCamera& camera : {wide_lens(), calibrated_lens()}) {
    const PreparedLens lens = prepare(camera);
    const double z = camera.focus_distance_mm;
    for (const Eigen::Vector3d& point : {Eigen::Vector3d(0, 0, z), Eigen::Vector3d(0.15 * z, -0.1 * z, z)}) {
      const Eigen::Vector2d expected = project(camera, point);
      for (double u : {0.0, 0.3, 0.99}) {
        for (double v : {0.01, 0.5, 0.8}) EXPECT_NEAR((image_of(lens, point, u, v) - expected).norm(), 0.0, 1e-6);
      }
    }
  }
}

TEST(LensFocus, OutOfFocusThePointIsADiscOfTheThinLensFormula) {
  for (double focus : {50.0, kInfinite}) {
    LensCamera camera = wide_lens();
    camera.focus_distance_mm = focus;
    camera.matrix = matrix_of_lens(4.0, focus, 100.0, 64, 48);
    EXPECT_NEAR(focal_length_mm(camera), 4.0, 1e-12);
    const PreparedLens lens = prepare(camera);
    for (double z : {20.0, 49.0, 80.0, 1e4}) {
      const Eigen::Vector3d point(0.1 * z, 0.05 * z, z);
      // Image distances by 1/f = 1/v + 1/z: where the cone's point lies before or behind the sensor.
      const double v = 1.0 / (1.0 / 4.0 - 1.0 / focus);
      const double sharp_v = 1.0 / (1.0 / 4.0 - 1.0 / z);
      const double expected = camera.aperture_mm * std::abs(sharp_v - v) / sharp_v;
      EXPECT_NEAR(blur_circle_mm(camera, z), expected, 1e-12);
      const Eigen::Vector2d left = image_of(lens, point, 0.0, 0.5);
      const Eigen::Vector2d right = image_of(lens, point, 1.0 - 1e-15, 0.5);
      EXPECT_NEAR((right - left).norm() * 0.1, expected, 1e-6) << z;
    }
  }
}

// A bright ball, small and out of focus: the variance of a disc of diameter c is (c/4)^2 along each axis, to which the
// ball (of radius r, seen as a disc) and the pixel add theirs.
TEST(LensFocus, RenderedBlurHasTheDiscsVariance) {
  LensCamera camera = wide_lens();
  camera.width = camera.height = 48;
  camera.pixel_pitch_um = 10.0;
  camera.matrix = matrix_of_lens(4.0, 50.0, 10.0, 48, 48);
  const double z = 20.0;
  const double radius = 0.25;
  Scene scene = empty_scene(0.0);
  scene.balls.push_back({{0, 0, z}, radius, Emitter{grey(1.0)}});
  camera.gel_from_camera = look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0});
  const cv::Mat image = Tracer(scene).render(camera, samples(2048)).irradiance;
  double sum = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double squares = 0.0;
  for (int row = 0; row < 48; ++row) {
    for (int column = 0; column < 48; ++column) {
      const double light = image.at<float>(row, column);
      sum += light;
      mean += light * Eigen::Vector2d(column + 0.5, row + 0.5);
      squares += light * (std::pow(column + 0.5 - 24.0, 2) + std::pow(row + 0.5 - 24.0, 2)) / 2.0;
    }
  }
  ASSERT_GT(sum, 0.0);
  // Some 190,000 paths hit the ball, 7 pixels from the middle in each direction: four standard errors.
  EXPECT_NEAR((mean / sum - Eigen::Vector2d(24.0, 24.0)).norm(), 0.0, 0.06);
  const double blur_px = blur_circle_mm(camera, z) / 0.01;
  const double ball_px = 2.0 * radius * sensor_distance_mm(camera) / z / 0.01;
  const double expected = blur_px * blur_px / 16.0 + ball_px * ball_px / 16.0;
  EXPECT_GT(blur_px, 10.0);
  EXPECT_NEAR(squares / sum / expected, 1.0, 0.007);
}

TEST(LensDistortion, EqualsOpenCvsProjection) {
  LensCamera rational = calibrated_lens();
  rational.distortion = {2.1, -1.3, 4e-4, 7e-4, 0.35, 2.4, -0.6, -0.1};
  LensCamera webcam = calibrated_lens();
  for (const LensCamera& camera : {webcam, rational}) {
    const LensDistortion& d = camera.distortion;
    const cv::Mat matrix = (cv::Mat_<double>(3, 3) << camera.matrix.fx, 0, camera.matrix.cx, 0, camera.matrix.fy,
                            camera.matrix.cy, 0, 0, 1);
    const cv::Mat coefficients = (cv::Mat_<double>(1, 8) << d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6);
    std::vector<cv::Point3d> points;
    for (double x = -0.38; x <= 0.38; x += 0.04) {
      for (double y = -0.28; y <= 0.28; y += 0.04) points.emplace_back(30.0 * x, 30.0 * y, 30.0);
    }
    std::vector<cv::Point2d> images;
    cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), matrix, coefficients, images);
    const PreparedLens lens = prepare(camera);
    int inside = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d point(points[i].x, points[i].y, points[i].z);
      const Eigen::Vector2d image = project(camera, point);
      // OpenCV's pixel centres are whole numbers.
      EXPECT_NEAR(image.x(), images[i].x + 0.5, 1e-6);
      EXPECT_NEAR(image.y(), images[i].y + 0.5, 1e-6);
      if (image.x() < 0 || image.y() < 0 || image.x() > camera.width || image.y() > camera.height) continue;
      ++inside;
      const CameraRay chief = lens_ray(lens, image.x(), image.y(), 0.5, 0.5);
      EXPECT_NEAR(chief.direction.cross(point.normalized()).norm(), 0.0, 1e-9);
    }
    EXPECT_GT(inside, 100);
  }
}

TEST(LensDistortion, DerivativeIsThatOfTheMap) {
  const LensDistortion d = {2.1, -1.3, 4e-3, 7e-3, 0.35, 2.4, -0.6, -0.1};
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.3, -0.2), Eigen::Vector2d(-0.1, 0.6)}) {
    const Eigen::Matrix2d derivative = distort_derivative(d, at);
    constexpr double kStep = 1e-6;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
      const Eigen::Vector2d slope = (distort(d, at + step) - distort(d, at - step)) / (2.0 * kStep);
      EXPECT_NEAR((slope - derivative.col(axis)).norm(), 0.0, 1e-8);
    }
  }
}

TEST(LensDistortion, UndistortingUndoesDistorting) {
  for (const LensDistortion& d :
       {LensDistortion{-0.31, 0.12, 1e-3, -8e-4, -0.02}, LensDistortion{0.4, 0.2, 0.0, 0.0, 0.1}, LensDistortion{-0.3},
        LensDistortion{2.1, -1.3, 4e-4, 7e-4, 0.35, 2.4, -0.6, -0.1}}) {
    const DistortionReach reach = radial_reach(d);
    const double most = std::min(0.97 * reach.undistorted, 1.2);
    for (int i = 0; i < 400; ++i) {
      const double radius = most * (i + 0.5) / 400.0;
      const Eigen::Vector2d at(radius * std::cos(i), radius * std::sin(i));
      if (!(distort_derivative(d, at).determinant() > 0.0)) continue;
      const auto back = undistort(d, reach, distort(d, at));
      ASSERT_TRUE(back) << radius << " of " << reach.undistorted;
      EXPECT_NEAR((*back - at).norm(), 0.0, 1e-10);
    }
  }
}

TEST(LensDistortion, TurnsBackWhereCalculusSays) {
  // r - k r^3 turns at r = 1 / sqrt(3 k), where it is two thirds of r.
  const DistortionReach reach = radial_reach({-0.3});
  EXPECT_NEAR(reach.undistorted, 1.0 / std::sqrt(0.9), 1e-12);
  EXPECT_NEAR(reach.distorted, 2.0 / 3.0 / std::sqrt(0.9), 1e-12);
  EXPECT_EQ(radial_reach({}).undistorted, kInfinite);
  EXPECT_EQ(radial_reach({0.2, 0.1}).undistorted, kInfinite);
  // 1 / (1 - r^2) has a pole at 1 before which it only grows.
  const DistortionReach pole = radial_reach({0, 0, 0, 0, 0, -1.0});
  EXPECT_NEAR(pole.undistorted, 1.0, 1e-12);
  EXPECT_EQ(pole.distorted, kInfinite);
  EXPECT_FALSE(undistort({-0.3}, reach, {reach.distorted + 1e-6, 0.0}));
}

std::string complaint(const LensCamera& camera) {
  try {
    check_camera(camera);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(LensDistortion, ThatFoldsThePictureIsRefusedNamingTheRadius) {
  LensCamera camera = wide_lens();  // corner at a tangent of 0.92
  camera.distortion.k1 = -0.3;      // turns at a tangent of 1.054, which appears at 0.703: 30.55 pixels
  EXPECT_THAT(complaint(camera), testing::HasSubstr("beyond 30.6 pixels"));
  EXPECT_THAT(complaint(camera), testing::HasSubstr("corner lies at 40.0"));
  camera.distortion = {};
  camera.distortion.p1 = 0.6;
  EXPECT_THAT(complaint(camera), testing::HasSubstr("can't be inverted at pixel"));
  camera.distortion.p1 = 0.0;
  camera.distortion.k1 = -0.05;
  EXPECT_EQ(complaint(camera), "");
}

TEST(LensCamera, BadFieldsAreNamed) {
  const auto refused = [](const char* field, const auto& spoil) {
    LensCamera camera = wide_lens();
    ASSERT_EQ(complaint(camera), "");
    spoil(camera);
    EXPECT_THAT(complaint(camera), testing::HasSubstr(field));
    EXPECT_THROW(Tracer(empty_scene(1.0)).render(camera, samples(4)), Error);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused("size", [](LensCamera& c) { c.width = 0; });
  refused("pixel_pitch_um", [nan](LensCamera& c) { c.pixel_pitch_um = nan; });
  refused("aperture_mm", [](LensCamera& c) { c.aperture_mm = 0.0; });
  refused("focus_distance_mm", [](LensCamera& c) { c.focus_distance_mm = -1.0; });
  refused("fx", [](LensCamera& c) { c.matrix.fx = 0.0; });
  refused("principal point", [nan](LensCamera& c) { c.matrix.cy = nan; });
  refused("coefficient", [nan](LensCamera& c) { c.distortion.p2 = nan; });
  refused("gel_from_camera", [](LensCamera& c) { c.gel_from_camera.rotation *= 2.0; });
  EXPECT_THROW(matrix_of_lens(4.0, 3.0, 10.0, 64, 48), Error);
  EXPECT_THROW(matrix_of_lens(-4.0, 30.0, 10.0, 64, 48), Error);
  EXPECT_THROW(focus_of_sensor(4.0, 3.9), Error);
  EXPECT_NEAR(focus_of_sensor(4.0, 1.0 / (1.0 / 4.0 - 1.0 / 50.0)), 50.0, 1e-9);
  EXPECT_EQ(focus_of_sensor(4.0, 4.0), kInfinite);
}

TEST(LensImage, TheImagePointOfAViewIsTheOneThatLooksThere) {
  const PreparedLens lens = prepare(calibrated_lens());
  for (double x : {0.0, 0.5, 123.4, 331.7, 500.0, 640.0}) {
    for (double y : {0.0, 77.7, 226.4, 400.0, 480.0}) {
      const auto view = view_direction(lens, x, y);
      ASSERT_TRUE(view);
      EXPECT_NEAR(view->norm(), 1.0, 1e-15);
      EXPECT_LT((*view - lens_ray(lens, x, y, 0.5, 0.5).direction).norm(), 1e-12)
          << "as light through the centre comes";
      const auto back = image_point(lens, 7.0 * *view);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - Eigen::Vector2d(x, y)).norm(), 1e-9);
    }
  }
  EXPECT_FALSE(image_point(lens, {0.1, 0.2, -1.0}));
  EXPECT_FALSE(image_point(lens, {1.0, 0.0, 0.0}));
}

// By the formula alone, with k1 = -0.3, what is seen along a tangent of 1.8 would appear as near the middle as 0.05.
TEST(LensImage, BeyondTheFoldNoImagePointLooks) {
  LensCamera camera = wide_lens();
  camera.width = 32;
  camera.height = 24;
  camera.matrix = matrix_of_lens(4.0, 50.0, 100.0, 32, 24);
  camera.distortion.k1 = -0.3;
  const PreparedLens lens = prepare(camera);
  EXPECT_NEAR(lens.reach.undistorted, 1.0 / std::sqrt(0.9), 1e-9);
  EXPECT_TRUE(image_point(lens, {1.05, 0.0, 1.0}));
  for (double tangent : {1.06, 1.3, 1.8, 1e3, 1e200}) {
    EXPECT_FALSE(image_point(lens, {tangent, 0.0, 1.0})) << tangent;
  }
  EXPECT_FALSE(view_direction(lens, 1e4, 20.0));
}

TEST(LensImage, IsUprightAndWhereProjectSays) {
  LensCamera camera = calibrated_lens();
  camera.width = 80;
  camera.height = 60;
  camera.matrix = {101.5, 101.1, 41.5, 28.3};
  camera.pixel_pitch_um = 44.8;
  camera.gel_from_camera = look_at({0, 0, -27}, {0, 0, 0}, {0, 1, 0});
  camera.focus_distance_mm = 20.0;
  const Eigen::Vector3d in_camera(5.0, 3.0, 20.0);
  Scene scene = empty_scene(1.0);
  scene.balls.push_back({camera.gel_from_camera * in_camera, 0.6, Black{}});
  const cv::Mat with = Tracer(scene).render(camera, samples(256)).irradiance;
  const cv::Mat without = Tracer(empty_scene(1.0)).render(camera, samples(256)).irradiance;
  Eigen::Vector2d centroid(0, 0);
  double weight = 0.0;
  for (int row = 0; row < 60; ++row) {
    for (int column = 0; column < 80; ++column) {
      const double missing = 1.0 - with.at<float>(row, column) / without.at<float>(row, column);
      centroid += missing * Eigen::Vector2d(column + 0.5, row + 0.5);
      weight += missing;
    }
  }
  centroid /= weight;
  const Eigen::Vector2d expected = project(camera, in_camera);
  EXPECT_GT(expected.x(), 60.0);
  EXPECT_GT(expected.y(), 40.0);
  EXPECT_NEAR((centroid - expected).norm(), 0.0, 0.05);
}

}  // namespace
}  // namespace touchstone::render
