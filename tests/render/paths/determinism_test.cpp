// The same bytes for any number of threads, any mask; samples are spent where the noise asks for them; hard light.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <thread>

#include "core/error.h"
#include "light_scenes.h"

namespace touchstone::render {
namespace {

Scene busy_scene(int bands = 3) {
  const auto all = [bands](double value) { return Spectrum(Spectrum::Constant(bands, value)); };
  Scene scene;
  scene.environment = all(0.01);
  scene.media = {Medium{1.0, {}}, Medium{1.52, {}}, Medium{1.41, all(0.002)}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}};
  scene.surfaces.push_back({square_sheet(10.0, 0.0), Refractive{2, 0}});
  scene.surfaces.push_back({square_sheet(4.0, 0.3, false), Lambertian{all(0.8)}});
  for (int i = -1; i <= 1; ++i) scene.balls.push_back({{2.0 * i, 0, -0.75}, 0.25, RoughConductor{all(0.6), 0.3}});
  SpotLamp lamp;
  lamp.position = {10, 0, -24};
  lamp.direction = {-10, 0, 24};
  lamp.lens_radius = 2.0;
  lamp.power_W = all(0.1);
  scene.lamps.push_back(lamp);
  return scene;
}

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && a.isContinuous() && b.isContinuous() &&
         std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

TEST(Determinism, OneAndFourThreadsGiveTheSameBytes) {
  const PinholeCamera camera = small_camera(40, 30);
  RenderSettings settings = samples(8);
  settings.noise = NoiseTarget{Spectrum::Constant(3, 1e6), 3.0, 10.0, 0.5};
  settings.max_samples = 64;
  RenderedImage images[2];
  cv::Mat previews[2];
  for (int i = 0; i < 2; ++i) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, i == 0 ? 1 : 4);
    const Tracer tracer(busy_scene());
    images[i] = tracer.render(camera, settings);
    previews[i] = tracer.preview(camera, 3);
  }
  EXPECT_TRUE(same_bytes(images[0].irradiance, images[1].irradiance));
  EXPECT_TRUE(same_bytes(images[0].standard_error, images[1].standard_error));
  EXPECT_TRUE(same_bytes(images[0].samples, images[1].samples));
  EXPECT_TRUE(same_bytes(previews[0], previews[1]));
  EXPECT_EQ(images[0].counts.bounces, images[1].counts.bounces);
  EXPECT_GT(cv::countNonZero(previews[0].reshape(1)), 0);
}

TEST(Determinism, RenderingLeavesTheProcessItsThreads) {
  const auto threads = [] { return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism); };
  const std::size_t before = threads();
  const Tracer tracer(busy_scene());
  EXPECT_EQ(threads(), before);
}

TEST(Determinism, AMaskedPixelIsThePixelOfTheWholeImage) {
  const PinholeCamera camera = small_camera(24, 18);
  const Tracer tracer(busy_scene());
  cv::Mat mask = cv::Mat::zeros(18, 24, CV_8UC1);
  for (int i = 0; i < 18; ++i) mask.at<unsigned char>(i, i) = 1;
  const RenderedImage whole = tracer.render(camera, samples(8));
  const RenderedImage part = tracer.render(camera, samples(8), mask);
  for (int row = 0; row < 18; ++row) {
    for (int column = 0; column < 24; ++column) {
      const cv::Vec3f expected = row == column ? whole.irradiance.at<cv::Vec3f>(row, column) : cv::Vec3f(0, 0, 0);
      EXPECT_EQ(part.irradiance.at<cv::Vec3f>(row, column), expected);
    }
  }
  EXPECT_EQ(part.counts.paths, 18u * 8u);
}

TEST(Determinism, BandsOfEqualContentAreEqualAndEqualToGrey) {
  const PinholeCamera camera = small_camera(12, 9);
  const cv::Mat grey_image = Tracer(busy_scene(1)).render(camera, samples(8)).irradiance;
  for (const int bands : {3, 8, 16}) {
    const cv::Mat image = Tracer(busy_scene(bands)).render(camera, samples(8)).irradiance;
    ASSERT_EQ(image.channels(), bands);
    for (int row = 0; row < 9; ++row) {
      for (int column = 0; column < 12; ++column) {
        const float* value = image.ptr<float>(row, column);
        for (int k = 1; k < bands; ++k) EXPECT_EQ(value[0], value[k]);
        EXPECT_NEAR(value[0], grey_image.at<float>(row, column), 1e-5 * value[0]);
      }
    }
  }
  EXPECT_THROW(Tracer(busy_scene(2)), Error);
}

/// Pixels smaller than the hole's blur, as a real sensor has: at most a soft edge within a pixel's view.
PinholeCamera fine_camera() {
  PinholeCamera camera = small_camera(24, 18);
  camera.pixel_pitch_um = 45.0;
  return camera;
}

TEST(NoiseTargets, StopWhereTheImagerIsNoisierAndAreHonest) {
  const PinholeCamera camera = fine_camera();
  Scene scene = busy_scene(1);
  scene.interreflection = false;
  const Tracer tracer(scene);
  const cv::Mat truth = tracer.render(camera, samples(1024)).irradiance;
  RenderSettings settings = samples(32);
  settings.max_samples = 1024;
  const double electrons_per_irradiance = 4000.0 / cv::mean(truth)[0];
  settings.noise = NoiseTarget{grey(electrons_per_irradiance), 3.0, 12.0, 0.5};
  const RenderedImage image = tracer.render(camera, settings);
  double squares = 0.0;
  for (int row = 0; row < 18; ++row) {
    for (int column = 0; column < 24; ++column) {
      const double electrons = truth.at<float>(row, column) * electrons_per_irradiance;
      const double off = image.irradiance.at<float>(row, column) * electrons_per_irradiance - electrons;
      const double noise = std::sqrt(electrons + 9.0 + 144.0);
      squares += off * off / (noise * noise) / (18 * 24);
      EXPECT_LT(std::abs(off), 6.0 * noise) << row << " " << column;
    }
  }
  EXPECT_LT(std::sqrt(squares), 0.6);  // asked for: 0.5
  const double spent = cv::sum(image.samples)[0] / (18 * 24);
  EXPECT_LT(spent, 500.0);
  settings.noise->fraction = 5.0;
  EXPECT_LT(cv::sum(tracer.render(camera, settings).samples)[0] / (18 * 24), 0.5 * spent);
}

TEST(NoiseTargets, ReportedErrorCoversTheTrueOne) {
  const PinholeCamera camera = fine_camera();
  const Tracer tracer(busy_scene(1));
  const cv::Mat truth = tracer.render(camera, samples(1024)).irradiance;
  const double floor = 2e-3 * cv::mean(truth)[0];
  double ratio = 0.0;
  RenderSettings settings = samples(64);
  settings.seed = 1234;
  const RenderedImage image = tracer.render(camera, settings);
  for (int row = 0; row < 18; ++row) {
    for (int column = 0; column < 24; ++column) {
      const double off = image.irradiance.at<float>(row, column) - truth.at<float>(row, column);
      // Where nothing at all was seen the error reads zero: hence a floor.
      const double error = std::hypot(image.standard_error.at<float>(row, column), floor);
      ratio += std::pow(off / error, 2) / (18 * 24);
    }
  }
  EXPECT_LT(std::sqrt(ratio), 1.2);  // stratified: better than reported, not worse
  EXPECT_GT(std::sqrt(ratio), 0.2);
}

TEST(Preview, HasNoNoiseAndShowsWhatMoved) {
  const PinholeCamera camera = small_camera(60, 40);
  Scene scene = busy_scene(1);
  const cv::Mat before = Tracer(scene).preview(camera, 1);
  EXPECT_EQ(before.size(), cv::Size(60, 40));
  EXPECT_TRUE(same_bytes(before, Tracer(scene).preview(camera, 1)));
  scene.balls[1].centre.x() += 0.4;
  const cv::Mat after = Tracer(scene).preview(camera, 1);
  cv::Mat changed = before != after;
  EXPECT_GT(cv::countNonZero(changed), 0);
  EXPECT_LT(cv::countNonZero(changed), 60 * 40 / 4);
}

TEST(HardLight, GrazingLampsStayFinite) {
  for (const Eigen::Vector3d& position :
       {Eigen::Vector3d(500, 0, -7.000001), Eigen::Vector3d(9, 0, -6.999), Eigen::Vector3d(0, 0, -1.0001),
        Eigen::Vector3d(3, 0, 0.29999), Eigen::Vector3d(0, 0, -7.0), Eigen::Vector3d(0, 0, 0.3)}) {
    Scene scene = busy_scene(1);
    scene.lamps[0] = half_space_lamp(position, {0, 0, 1}, 0.001);
    scene.lamps.push_back(half_space_lamp(position, {-1, 0, 0}, 0.001));
    const cv::Mat image = Tracer(scene).render(small_camera(24, 18), samples(16)).irradiance;
    EXPECT_TRUE(cv::checkRange(image, true, nullptr, 0.0, 1e9)) << position.transpose();
  }
}

TEST(HardLight, CoincidentThingsStayFinite) {
  Scene scene = busy_scene(1);
  scene.faces.insert(scene.faces.begin() + 1, FlatFace{-7.0, 1, 1});           // a layer of no thickness
  scene.surfaces.push_back({square_sheet(4.0, 0.3, false), Black{}});          // the same sheet twice
  scene.surfaces.push_back({square_sheet(4.0, -5.0), Lambertian{grey(0.5)}});  // in a face
  scene.balls.push_back({{0, 3, -0.25}, 0.25, Lambertian{grey(1.0)}});         // touches the gel's surface
  scene.balls.push_back({{0, 3, -0.25}, 0.25, Lambertian{grey(1.0)}});
  const cv::Mat image = Tracer(scene).render(small_camera(24, 18), samples(16)).irradiance;
  EXPECT_TRUE(cv::checkRange(image, true, nullptr, 0.0, 1e3));
}

}  // namespace
}  // namespace touchstone::render
