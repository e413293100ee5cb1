#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "render/direct/direct_renderer.h"
#include "tests/render/direct/direct_scenes.h"

namespace touchstone::render {
namespace {

TEST(DirectRenderer, SpreadingCentralRaysIsTheHolesOwnBlur) {
  Scene scene = dented_scene(1.0, Lambertian{grey(0.7)});
  scene.balls.push_back({{1.5, 0.5, -1.1}, 0.25, Lambertian{grey(0.3)}});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-3));
  PinholeCamera camera = small_camera(96, 72);
  camera.pixel_pitch_um *= 0.7;  // the picture's edge sees the membrane, too
  const auto picture = [&](int samples, bool blur) {
    DirectSettings settings;
    settings.samples = samples;
    settings.blur = blur;
    settings.rays_across_blur = 4.0;
    return DirectRenderer(field, camera, scene, settings).render(scene).irradiance;
  };
  const cv::Mat whole = picture(64, true);
  const auto error = [&](const cv::Mat& image) { return cv::norm(image, whole, cv::NORM_L2) / cv::norm(whole); };
  const cv::Mat spread = picture(1, true);
  EXPECT_LT(error(spread), 0.008);  // most of it the 64 samples' own noise
  EXPECT_GT(error(picture(1, false)), 5.0 * error(spread));
  EXPECT_NEAR(cv::mean(spread)[0] / cv::mean(whole)[0], 1.0, 2e-3);
}

// Parts of unequal size, 4, 3, 3, 3 and 3 of 16 rays: weighted so they are all the rays' picture.
TEST(DirectRenderer, ThePartsOfItsRaysMakeTheWhole) {
  const Scene scene = dented_scene(1.0, Lambertian{grey(0.7)});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-3));
  DirectSettings settings;
  settings.samples = 16;
  DirectRenderer renderer(field, small_camera(48, 36), scene, settings);
  const DirectImage whole = renderer.render(scene);
  cv::Mat sum = cv::Mat::zeros(whole.irradiance.size(), whole.irradiance.type());
  std::uint64_t rays = 0;
  for (int first = 0; first < 5; ++first) {
    const DirectImage part = renderer.render(scene, {first, 5});
    sum += part.irradiance * ((first == 0 ? 4.0 : 3.0) / 16.0);
    rays += part.primary;
    const double apart = cv::norm(part.irradiance, whole.irradiance) / cv::norm(whole.irradiance);
    EXPECT_GT(apart, 1e-4);
    EXPECT_LT(apart, 0.1);
  }
  EXPECT_EQ(rays, whole.primary);
  EXPECT_LT(cv::norm(sum, whole.irradiance, cv::NORM_INF), 1e-5 * cv::norm(whole.irradiance, cv::NORM_INF));
}

TEST(DirectRenderer, MoreRaysAtEdgesGiveThePixelsArea) {
  Scene scene = dented_scene(0.0, Lambertian{grey(0.7)});
  for (Lamp& lamp : scene.lamps)
    std::get<SpotLamp>(lamp).lens_radius = 0.0;  // else shadows have rims that one direction can't tell
  scene.balls.push_back({{1.5, 0.5, -1.1}, 0.25, Lambertian{grey(0.1)}});
  scene.balls.push_back({{-2.0, 1.0, -0.8}, 0.4, Black{}});
  const LightField field = make_light_field(scene, reach_of_membrane(), accuracy(1e-3));
  PinholeCamera camera = small_camera(96, 72);
  camera.pixel_pitch_um *= 0.7;
  camera.hole_diameter_um = 1e-3;
  camera.foil_thickness_um = 0.0;
  const auto picture = [&](int samples, int side) {
    DirectSettings settings;
    settings.samples = samples;
    settings.edge_side = side;
    return DirectRenderer(field, camera, scene, settings).render(scene);
  };
  const cv::Mat whole = picture(64, 1).irradiance;
  const auto error = [&](const DirectImage& image) {
    return cv::norm(image.irradiance, whole, cv::NORM_L2) / cv::norm(whole);
  };
  const DirectImage one = picture(1, 1);
  const DirectImage many = picture(1, 4);
  EXPECT_EQ(one.edge_pixels, 0u);
  EXPECT_GT(many.edge_pixels, 100u);
  EXPECT_LT(many.edge_pixels, 96u * 72u / 4u);
  EXPECT_LT(error(many), 0.25 * error(one));
  EXPECT_LT(error(picture(1, 2)), 0.6 * error(one));
}

// A sheet's edge that runs with the rows, or the columns, at ten places between two pixels: what is covered is found
// over all of it, and in each row to one ray.
TEST(DirectRenderer, AnEdgeThatRunsWithThePixelsIsWhereItIs) {
  const Scene whole = plane_scene({2, 1, -15});
  const LightField field =
      make_light_field(whole, {Eigen::Vector3d(-9, -9, -0.2), Eigen::Vector3d(9, 9, 0.2)}, accuracy(5e-3));
  PinholeCamera camera = small_camera(64, 64);
  camera.pixel_pitch_um *= 0.5;
  camera.hole_diameter_um = 1e-3;
  camera.foil_thickness_um = 0.0;
  const double mm_per_px = camera.pixel_pitch_um * 1e-3 * 27.0 / camera.distance_mm;
  for (const int side : {2, 4}) {
    DirectSettings settings;
    settings.edge_side = side;
    const cv::Mat full = DirectRenderer(field, camera, whole, settings).render(whole).irradiance;
    for (int step = 0; step < 10; ++step) {
      const double edge_px = 20.0 + step / 10.0 + 0.03;  // from the picture's middle
      for (const int axis : {0, 1}) {
        Scene scene = whole;
        for (Eigen::Vector3d& vertex : scene.surfaces[0].mesh.vertices) {
          vertex[axis] = std::clamp(vertex[axis], -edge_px * mm_per_px, edge_px * mm_per_px);
        }
        cv::Mat covered = DirectRenderer(field, camera, scene, settings).render(scene).irradiance / full;
        if (axis == 1) covered = covered.t();
        double sum = 0.0;
        for (int row = 8; row < 56; ++row) {
          const double found = cv::sum(covered.row(row).colRange(8, 56))[0];
          EXPECT_NEAR(found, 2.0 * edge_px, 2.0 / (side * side) + 2e-3) << side << " " << step << " " << row;
          sum += found / 48.0;
        }
        EXPECT_NEAR(sum, 2.0 * edge_px, 0.012) << side << " " << step;
      }
    }
  }
}

}  // namespace
}  // namespace touchstone::render
