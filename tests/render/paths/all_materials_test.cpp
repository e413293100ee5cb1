// One scene with every material and a scattering medium: the same bytes for any number of threads, all finite.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <opencv2/core.hpp>

#include "light_scenes.h"

namespace touchstone::render {
namespace {

Scene everything(int bands) {
  const auto all = [bands](double value) { return Spectrum(Spectrum::Constant(bands, value)); };
  Scene scene;
  scene.environment = all(0.01);
  scene.media = {Medium{1.0}, Medium{1.52}, Medium{1.41, all(0.002), all(0.3), 0.6}, Medium{1.7}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Refractive{2, 0}});
  Print print;
  print.material_mm = {{-4, -4}, {4, -4}, {4, 4}, {-4, 4}};
  print.inks = {all(0.05)};
  print.marks = {{{0, 0}, 1.0, 0}};
  scene.surfaces.push_back({square_sheet(4.0, 0.3, false), Lambertian{all(0.8)}, print});
  scene.surfaces.push_back({square_sheet(2.0, -3.0), ThinFilm{all(0.7), 1.5, true}});
  scene.surfaces.push_back({square_sheet(0.7, -2.0), DiffuseTransmitter{all(0.4), all(0.5)}});
  scene.balls.push_back({{2, 0, -1.5}, 0.5, RoughRefractive{3, 2, 0.3}});
  scene.balls.push_back({{-2, 0, -1.5}, 0.5, Refractive{3, 2}});
  scene.balls.push_back({{0, 2, -1.5}, 0.5, RoughConductor{all(0.6), 0.3}});
  scene.balls.push_back({{0, -2, -1.5}, 0.5, Emitter{all(0.2)}});
  scene.balls.push_back({{2, 2, -1.5}, 0.5, Black{}});
  for (double x : {-10.0, 10.0}) {
    SpotLamp lamp;
    lamp.position = {x, 0, -24};
    lamp.direction = {-x, 0, 24};
    lamp.lens_radius = 2.0;
    lamp.power_W = all(0.1);
    scene.lamps.push_back(lamp);
  }
  return scene;
}

TEST(AllMaterials, OneAndFourThreadsGiveTheSameBytes) {
  cv::Mat images[2];
  for (int i = 0; i < 2; ++i) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, i == 0 ? 1 : 4);
    images[i] = Tracer(everything(3)).render(small_camera(40, 30), samples(8, 8)).irradiance;
  }
  EXPECT_EQ(std::memcmp(images[0].data, images[1].data, images[0].total() * images[0].elemSize()), 0);
  EXPECT_TRUE(cv::checkRange(images[0], true, nullptr, 0.0, 1e9));
  EXPECT_GT(cv::countNonZero(images[0].reshape(1)), 0);
}

// The bands' weights in a medium are those of one band where all bands are alike.
TEST(AllMaterials, EqualBandsShowWhatOneBandShows) {
  const cv::Mat colour = Tracer(everything(3)).render(small_camera(24, 18), samples(32, 8)).irradiance;
  const cv::Mat grey_image = Tracer(everything(1)).render(small_camera(24, 18), samples(32, 8)).irradiance;
  for (int row = 0; row < 18; ++row) {
    for (int column = 0; column < 24; ++column) {
      const cv::Vec3f value = colour.at<cv::Vec3f>(row, column);
      EXPECT_NEAR(value[0], value[1], 1e-5 * value[0]);
      EXPECT_NEAR(value[0], value[2], 1e-5 * value[0]);
    }
  }
  EXPECT_NEAR(cv::mean(colour)[0] / cv::mean(grey_image)[0], 1.0, 0.02);
}

TEST(AllMaterials, PreviewHasNoNoiseAndIsFinite) {
  const Tracer tracer(everything(3));
  const cv::Mat preview = tracer.preview(small_camera(40, 30), 2);
  EXPECT_TRUE(cv::checkRange(preview, true, nullptr, 0.0, 1e9));
  EXPECT_EQ(cv::norm(preview, tracer.preview(small_camera(40, 30), 2), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::countNonZero(preview.reshape(1)), 0);
}

}  // namespace
}  // namespace touchstone::render
