// Where things appear through glass and gel, and what equal indices do.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "closed_forms/light_closed_forms.h"
#include "light_scenes.h"

namespace touchstone::render {
namespace {

/// Centroid of what is darker in `with` than in `without`, within the mask, in pixels.
Eigen::Vector2d dark_centroid(const cv::Mat& with, const cv::Mat& without) {
  Eigen::Vector2d sum(0, 0);
  double weight = 0.0;
  for (int row = 0; row < with.rows; ++row) {
    for (int column = 0; column < with.cols; ++column) {
      const double full = without.at<float>(row, column);
      if (full <= 0.0) continue;
      const double missing = 1.0 - with.at<float>(row, column) / full;
      sum += missing * Eigen::Vector2d(column + 0.5, row + 0.5);
      weight += missing;
    }
  }
  return sum / weight;
}

TEST(ApparentDepth, ABeadIsSeenWhereSnellPutsIt) {
  PinholeCamera camera;  // 640 x 480, sharp
  camera.pixel_pitch_um = 3.45;
  camera.distance_mm = 3.0;
  camera.hole_diameter_um = 8.0;
  camera.foil_thickness_um = 0.0;
  camera.gel_from_camera = look_at({0, 0, -27}, {0, 0, 0}, {0, 1, 0});
  for (const Eigen::Vector3d& centre : {Eigen::Vector3d(0, 0, -0.75), Eigen::Vector3d(4.5, 3.0, -0.75),
                                        Eigen::Vector3d(-6.0, 2.0, -3.0), Eigen::Vector3d(7.0, -4.5, -0.3)}) {
    const double lateral = centre.head<2>().norm();
    const std::array<double, 3> thicknesses = {20.0, 2.0, 5.0 + centre.z()};
    const std::array<double, 3> indices = {1.0, 1.52, 1.41};
    const double tangent = closed_forms::apparent_tangent(thicknesses, indices, lateral);
    Eigen::Vector3d seen(0, 0, 1);
    if (lateral > 0.0) seen.head<2>() = tangent * centre.head<2>() / lateral;
    const Eigen::Vector2d expected = project(camera, camera.gel_from_camera.rotation.transpose() * seen);
    const Eigen::Vector2d straight = project(camera, camera.gel_from_camera.inverse() * centre);

    Scene scene = sensor_stack(1.0);
    cv::Mat mask = cv::Mat::zeros(camera.height, camera.width, CV_8UC1);
    const cv::Rect around(static_cast<int>(expected.x()) - 14, static_cast<int>(expected.y()) - 14, 29, 29);
    mask(around & cv::Rect(0, 0, camera.width, camera.height)) = 1;
    const cv::Mat without = Tracer(scene).render(camera, samples(64), mask).irradiance;
    scene.balls.push_back({centre, 0.25, Black{}});
    const cv::Mat with = Tracer(scene).render(camera, samples(64), mask).irradiance;
    EXPECT_LT((dark_centroid(with, without) - expected).norm(), 0.1) << centre.transpose();
    if (lateral > 0.0) {
      EXPECT_GT((expected - straight).norm(), 3.0) << "the test would pass without refraction";
    }
  }
}

/// A small scene with all kinds of things in gel; `layers` cuts the air into layers of equal index.
Scene seam_scene(bool cut) {
  Scene scene = empty_scene(0.3);
  if (cut) {
    scene.media = {Medium{1.0, {}}, Medium{1.0, {}}};
    scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 0}, {-5.0, 0, 1}};
    scene.surfaces.push_back({square_sheet(10.0, -0.5), Refractive{1, 0}});
    scene.balls.push_back({{0, 1, -3}, 0.7, Refractive{0, 1}});
  }
  scene.surfaces.push_back({square_sheet(6.0, 0.5, false), Lambertian{grey(0.7)}});
  scene.balls.push_back({{1, 0, -2}, 1.0, Lambertian{grey(0.5)}});
  SpotLamp lamp;
  lamp.position = {4, 0, -20};
  lamp.direction = {-4, 0, 20};
  lamp.lens_radius = 1.0;
  lamp.power_W = grey(0.5);
  scene.lamps.push_back(lamp);
  return scene;
}

TEST(IndexMatch, EqualIndicesLeaveNoSeamAndNoNoise) {
  const PinholeCamera camera = small_camera(32, 24);
  const cv::Mat plain = Tracer(seam_scene(false)).render(camera, samples(16)).irradiance;
  const cv::Mat cut = Tracer(seam_scene(true)).render(camera, samples(16)).irradiance;
  // The same random numbers, the same paths up to rounding: a ray that grazes an edge may fall to the other side.
  int different = 0;
  for (int row = 0; row < plain.rows; ++row) {
    for (int column = 0; column < plain.cols; ++column) {
      const double a = plain.at<float>(row, column);
      different += std::abs(cut.at<float>(row, column) - a) > 1e-4 * a;
    }
  }
  EXPECT_LE(different, plain.rows * plain.cols / 100);
}

TEST(WetContact, ObjectInTheGelIsSeenWithoutTheFace) {
  // Dry, the object's light leaves through air and gel; wet, it starts in the gel: darker by n^2 but for Fresnel.
  const auto seen = [](bool wet) {
    Scene scene = sensor_stack(0.0);
    scene.interreflection = false;
    scene.lamps.push_back(half_space_lamp({0, 0, -27}, {0, 0, 1}, 1.0));
    if (!wet) scene.surfaces.push_back({square_sheet(50.0, 0.0), Refractive{2, 0}});
    scene.surfaces.push_back({square_sheet(50.0, 1e-3, false), Lambertian{grey(0.8)}});
    return Tracer(scene).radiance({0, 0, -2}, {0, 0, 1}, samples(1024))[0];
  };
  const double face = std::pow(0.41 / 2.41, 2);
  EXPECT_NEAR(seen(true) / seen(false) * 1.41 * 1.41 * (1.0 - face) * (1.0 - face), 1.0, 2e-3);
}

TEST(WetContact, LeaksAtTheBorderStayFinite) {
  // The hole in the gel surface is wider than the object.
  Scene scene = sensor_stack(1.0);
  scene.media[2].absorption = grey(0.01);
  scene.surfaces.push_back({square_sheet(1.0, 0.0, false), Lambertian{grey(0.8)}});
  scene.surfaces.push_back({square_sheet(9.0, 3.0, false), Refractive{2, 0}});  // a face met from the wrong medium
  scene.surfaces.push_back({square_sheet(9.0, 4.0, false), Lambertian{grey(0.8)}});
  scene.lamps.push_back(half_space_lamp({0, 0, -27}, {0, 0, 1}, 0.001));
  const cv::Mat image = Tracer(scene).render(small_camera(32, 24), samples(64)).irradiance;
  EXPECT_TRUE(cv::checkRange(image, true, nullptr, 0.0, 1.0));
}

}  // namespace
}  // namespace touchstone::render
