#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "render/cameras/first_hits.h"
#include "render/direct/direct_error.h"
#include "render/paths/trace_twice.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

constexpr double kHalf = 18.0;  // mm: light that the glass mirrors comes back within some 20 mm

/// A membrane on gel and glass with a dent of the given depth, two lamps below.
Scene membrane(double dent, bool interreflection) {
  Scene scene = sensor_stack(0.0);
  scene.interreflection = interreflection;
  for (const double x : {18.0, -14.0}) {
    SpotLamp lamp;
    lamp.position = {x, 0.5 * x, -18};
    lamp.direction = -lamp.position;
    lamp.lens_radius = 1.0;
    lamp.half_angle = 0.6;
    lamp.soft_angle = 0.3;
    lamp.power_W = grey(0.5);
    scene.lamps.push_back(lamp);
  }
  TriangleMesh mesh;
  constexpr int kSide = 100;
  for (int j = 0; j <= kSide; ++j) {
    for (int i = 0; i <= kSide; ++i) {
      const double x = kHalf * (2.0 * i / kSide - 1.0);
      const double y = kHalf * (2.0 * j / kSide - 1.0);
      mesh.vertices.emplace_back(x, y, -dent * std::exp(-(x * x + y * y) / 2.0));
    }
  }
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const int a = j * (kSide + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + kSide + 2});
      mesh.triangles.push_back({a, a + kSide + 2, a + kSide + 1});
    }
  }
  scene.surfaces.push_back({std::move(mesh), Lambertian{grey(0.6)}});
  return scene;
}

Eigen::AlignedBox3d reach() {
  return {Eigen::Vector3d(-kHalf, -kHalf, -1), Eigen::Vector3d(kHalf, kHalf, 0)};
}

PinholeCamera camera() {
  return small_camera(40, 30);
}

DirectRenderer renderer_of(const Scene& scene) {
  Scene direct = scene;
  direct.interreflection = false;
  LightFieldSettings settings;
  settings.accuracy = 4e-3;
  return DirectRenderer(make_light_field(direct, reach(), settings), camera(), direct);
}

DirectErrorSettings some(int pixels, int paths) {
  DirectErrorSettings settings;
  settings.pixels = pixels;
  settings.samples = paths;
  return settings;
}

TEST(DirectError, FindsAnErrorOfKnownSize) {
  const Scene scene = membrane(0.6, false);
  const cv::Mat picture = renderer_of(scene).render(scene).irradiance * 1.1;
  const DirectError error = measure_direct_error(picture, scene, camera(), some(300, 64));
  EXPECT_NEAR(error.pixels, 300, 20);
  EXPECT_NEAR(error.rms, 0.1, 4.0 * error.rms_error + 0.005);
  EXPECT_LT(error.rms_error, 0.01);
  // Relative to the root mean square, as the mean of an uneven picture is lower.
  EXPECT_NEAR(error.mean, 0.1 * cv::mean(picture)[0] / (cv::norm(picture) / std::sqrt(picture.total())),
              4.0 * error.mean_error + 0.005);
}

TEST(DirectError, LeavesTheReferencesNoiseOut) {
  const Scene scene = membrane(0.6, false);
  const cv::Mat picture = renderer_of(scene).render(scene).irradiance;
  RenderSettings few = samples(4);
  const RenderedImage noisy = Tracer(scene).render(camera(), few);
  const double noise = cv::norm(noisy.irradiance, picture, cv::NORM_L2) / cv::norm(picture);
  const DirectError error = measure_direct_error(picture, scene, camera(), some(1000, 4));
  EXPECT_GT(noise, 0.02);
  // Four standard errors of the mean product of some 1000 pixels are an eighth of the noise squared.
  EXPECT_LT(error.rms, 0.36 * noise);
  EXPECT_LT(std::abs(error.mean), 4.0 * error.mean_error + 2e-3);
}

/// The square's bound is its value and two standard errors: of one that can't be distinguished from 0, twice (0.6 %)^2.
TEST(DirectError, ItsRootIsBoundedByItsSquare) {
  EXPECT_DOUBLE_EQ(largest_rms({.rms = 0.0, .rms_error = 0.006}), std::sqrt(2.0) * 0.006);
  EXPECT_EQ(smallest_rms({.rms = 0.0, .rms_error = 0.006}), 0.0);
  const DirectError distinct{.rms = 0.1, .rms_error = 0.001};
  EXPECT_NEAR(largest_rms(distinct), 0.102, 3e-5);
  EXPECT_NEAR(smallest_rms(distinct), 0.098, 3e-5);
  const DirectError endless{.rms = std::numeric_limits<double>::infinity()};
  EXPECT_TRUE(std::isinf(largest_rms(endless)));
  EXPECT_TRUE(std::isinf(smallest_rms(endless)));
}

TEST(DirectError, OfADarkSceneIsNoneOrEndless) {
  Scene scene = membrane(0.0, false);
  scene.surfaces[0].material = Black{};
  cv::Mat picture = cv::Mat::zeros(30, 40, CV_32FC1);
  EXPECT_EQ(measure_direct_error(picture, scene, camera(), some(50, 1)).rms, 0.0);
  picture = 1.0f;
  EXPECT_TRUE(std::isinf(measure_direct_error(picture, scene, camera(), some(50, 1)).rms));
}

TEST(DirectError, RefusesPicturesOfOtherCameras) {
  const Scene scene = membrane(0.0, false);
  EXPECT_THROW(measure_direct_error(cv::Mat::zeros(30, 41, CV_32FC1), scene, camera()), Error);
  EXPECT_THROW(measure_direct_error(cv::Mat::zeros(30, 40, CV_32FC3), scene, camera()), Error);
  EXPECT_THROW(measure_direct_error(cv::Mat::zeros(30, 40, CV_32FC1), scene, camera(), some(1, 1)), Error);
  EXPECT_THROW(measure_direct_error(cv::Mat::zeros(30, 40, CV_32FC1), scene, camera(), some(10, 0)), Error);
}

TEST(RestLight, GivesTheRestPictureItsBouncedLight) {
  const Scene rest = membrane(0.0, true);
  DirectRenderer renderer = renderer_of(rest);
  RestLightSettings settings;
  settings.seed = 3;  // other numbers than the judge's
  renderer.set_bounced_light(measure_rest_light(renderer, rest, camera(), settings));
  const DirectError error = measure_direct_error(renderer.render(rest).irradiance, rest, camera(), some(400, 128));
  EXPECT_LT(error.rms, 0.01 + error.rms_error);
  EXPECT_LT(std::abs(error.mean), 3e-3 + 3.0 * error.mean_error);
}

TEST(RestLight, MostOfItStaysWhereTheMembraneIsPressed) {
  const Scene rest = membrane(0.0, true);
  const Scene pressed = membrane(0.5, true);
  DirectRenderer renderer = renderer_of(rest);
  Scene direct = pressed;
  direct.interreflection = false;
  const DirectError without =
      measure_direct_error(renderer.render(direct).irradiance, pressed, camera(), some(400, 128));
  renderer.set_bounced_light(measure_rest_light(renderer, rest, camera()));
  const DirectError with = measure_direct_error(renderer.render(pressed).irradiance, pressed, camera(), some(400, 128));
  EXPECT_LT(without.mean, -0.05);
  EXPECT_LT(with.rms, 0.25 * without.rms);
  renderer.set_bounced_light({});
  EXPECT_THROW(renderer.render(pressed), Error);  // asks for interreflection again
}

/// How much darker than paths a picture is in a dent, of what the paths show there; and the standard error of that.
Estimate missing_in_dent(const cv::Mat& picture, const Scene& pressed, double radius) {
  const std::vector<FirstHit> hits = first_hits(pressed, make_ready(Camera(camera())));
  cv::Mat mask = cv::Mat::zeros(picture.size(), CV_8U);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].object == 0 && hits[i].position.head<2>().norm() < radius) mask.data[i] = 255;
  }
  constexpr int kRuns = 8;
  double sum = 0.0;
  double squares = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    RenderSettings paths = samples(128);
    paths.seed = 100 + run;
    paths.max_depth = 16;
    const double traced = cv::mean(Tracer(pressed).render(camera(), paths, mask).irradiance, mask)[0];
    const double missing = 1.0 - cv::mean(picture, mask)[0] / traced;
    sum += missing / kRuns;
    squares += missing * missing / kRuns;
  }
  return {sum, std::sqrt(std::max(0.0, squares - sum * sum) / (kRuns - 1))};
}

// The flanks of a dent see the sheet round it.
TEST(RestLight, FlanksGetWhatTheSheetSendsThem) {
  const Scene rest = membrane(0.0, true);
  const Scene pressed = membrane(1.0, true);
  DirectRenderer renderer = renderer_of(rest);
  const cv::Mat light = measure_rest_light(renderer, rest, camera());
  renderer.set_bounced_light(light);
  const Estimate without = missing_in_dent(renderer.render(pressed).irradiance, pressed, 2.0);
  renderer.set_bounced_light(light, rest);
  const Estimate with = missing_in_dent(renderer.render(pressed).irradiance, pressed, 2.0);
  EXPECT_GT(without.mean, 5.0 * without.error) << "nothing bounces that matters";
  EXPECT_LT(std::abs(with.mean), 0.5 * without.mean + 2.0 * with.error);
  // The sheet itself at rest is as it was.
  const cv::Mat still = renderer.render(rest).irradiance;
  renderer.set_bounced_light(light);
  EXPECT_LT(cv::norm(still, renderer.render(rest).irradiance, cv::NORM_INF), 1e-5 * cv::norm(still, cv::NORM_INF));
}

TEST(RestLight, SameBytesForAnyThreads) {
  const Scene rest = membrane(0.0, true);
  RestLightSettings settings;
  settings.samples = 4;
  const auto light = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    DirectRenderer renderer = renderer_of(rest);
    return measure_rest_light(renderer, rest, camera(), settings);
  };
  const cv::Mat one = light(1);
  EXPECT_EQ(cv::norm(one, light(4), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::sum(one)[0], 0.0);
}

TEST(RestLight, RefusesFaultySettingsAndPictures) {
  const Scene rest = membrane(0.0, true);
  DirectRenderer renderer = renderer_of(rest);
  RestLightSettings settings;
  settings.samples = 0;
  EXPECT_THROW(measure_rest_light(renderer, rest, camera(), settings), Error);
  settings.samples = 1;
  settings.paths = 0;
  EXPECT_THROW(measure_rest_light(renderer, rest, camera(), settings), Error);
  settings.paths = 1;
  for (double bad : {-1.0, 1e4, std::numeric_limits<double>::quiet_NaN()}) {
    settings.smooth_mm = bad;
    EXPECT_THROW(measure_rest_light(renderer, rest, camera(), settings), Error);
  }
  EXPECT_THROW(renderer.set_bounced_light(cv::Mat::zeros(30, 40, CV_32FC3)), Error);
  EXPECT_THROW(renderer.set_bounced_light(cv::Mat::zeros(31, 40, CV_32FC1)), Error);
  cv::Mat light = cv::Mat::zeros(30, 40, CV_32FC1);
  light.at<float>(3, 3) = std::numeric_limits<float>::infinity();
  EXPECT_THROW(renderer.set_bounced_light(light), Error);
}

TEST(DirectChoice, TakesDirectLightWhereItIsGoodEnough) {
  const Scene rest = membrane(0.0, true);
  const Scene first = membrane(0.3, true);
  DirectChoiceSettings settings;
  settings.tolerance = 0.05;
  settings.error = some(400, 64);
  DirectChoice choice = choose_direct(rest, first, camera(), reach(), settings);
  ASSERT_NE(choice.renderer, nullptr) << choice.reason;
  EXPECT_EQ(choice.reason, "");
  EXPECT_LT(choice.error.rms, 0.05);
  EXPECT_GT(cv::sum(choice.renderer->render(first).irradiance)[0], 0.0);
}

TEST(DirectChoice, TakesMorePathsWhereItCannotTell) {
  const Scene rest = membrane(0.0, true);
  const Scene scene = membrane(0.6, true);
  DirectChoiceSettings settings;
  settings.error = some(100, 1);
  // The field's accuracy goes by the tolerance up to 2 %, so that all of these draw the same picture.
  settings.tolerance = 1.0;
  const DirectChoice sure = choose_direct(rest, scene, camera(), reach(), settings);
  ASSERT_NE(sure.renderer, nullptr);
  const double smallest = std::max(0.02, smallest_rms(sure.error));
  const double largest = largest_rms(sure.error);
  ASSERT_LT(smallest, 0.9 * largest);
  settings.tolerance = 0.5 * (smallest + largest);
  const DirectChoice unsure = choose_direct(rest, scene, camera(), reach(), settings);
  settings.error = some(100, 4);
  settings.tolerance = 1.0;
  const DirectChoice finer = choose_direct(rest, scene, camera(), reach(), settings);
  EXPECT_EQ(unsure.error.rms, finer.error.rms);
  EXPECT_EQ(unsure.error.rms_error, finer.error.rms_error);
  EXPECT_NE(sure.error.rms_error, finer.error.rms_error);
}

TEST(DirectChoice, WhereNothingIsGoodEnoughTakesWhatIsNearest) {
  const Scene rest = membrane(0.0, true);
  const Scene first = membrane(0.3, true);
  DirectChoiceSettings settings;
  settings.tolerance = 1e-3;
  settings.field_accuracy = 1e-2;
  settings.error = some(100, 4);
  const auto choice = [&](int paths) {
    settings.paths = paths;
    return choose_direct(rest, first, camera(), reach(), settings);
  };
  const DirectChoice few = choice(4);
  ASSERT_NE(few.renderer, nullptr) << few.reason;
  EXPECT_GT(few.error.rms, settings.tolerance);
  EXPECT_GT(few.paths_noise.value(), few.error.rms);
  EXPECT_GT(few.samples, 0);
  EXPECT_GT(cv::sum(few.renderer->render(first).irradiance)[0], 0.0);
  const DirectChoice many = choice(1 << 28);
  EXPECT_EQ(many.renderer, nullptr);
  EXPECT_THAT(many.reason, ::testing::HasSubstr("asked for"));
  EXPECT_LT(many.paths_noise.value(), 1e-3 * few.paths_noise.value());
  // Of a picture of so many paths, the difference from a close one.
  const cv::Mat all(30, 40, CV_8UC1, cv::Scalar(255));
  const auto fine = trace_twice(first, camera(), all, 4096, 16, 11);
  const auto coarse = trace_twice(first, camera(), all, 4, 16, 12);
  EXPECT_NEAR(few.paths_noise.value(), direct_error_beside(fine, coarse[0], all).rms, 0.15 * few.paths_noise.value());
  EXPECT_EQ(choice(0).renderer, nullptr);
}

TEST(DirectChoice, SaysWhyNot) {
  const Scene rest = membrane(0.0, true);
  const auto reason = [&](const Scene& at_rest, const Scene& first, double tolerance) {
    DirectChoiceSettings settings;
    settings.tolerance = tolerance;
    settings.error = some(60, 4);
    settings.rest.samples = 4;
    const DirectChoice choice = choose_direct(at_rest, first, camera(), reach(), settings);
    EXPECT_EQ(choice.renderer, nullptr);
    return choice.reason;
  };
  EXPECT_NE(reason(rest, rest, 2e-3).find("asked for"), std::string::npos);
  Scene refracting = rest;
  refracting.surfaces[0].material = Refractive{2, 0};
  EXPECT_NE(reason(refracting, refracting, 0.1).find("surface 0"), std::string::npos);
  Scene dark = rest;
  dark.lamps.clear();
  EXPECT_NE(reason(dark, dark, 0.1).find("no lamps"), std::string::npos);
  EXPECT_NE(reason(rest, membrane(0.0, false), 0.1).find("interreflection"), std::string::npos);
  DirectChoiceSettings faulty;
  faulty.tolerance = 0.0;
  EXPECT_THROW(choose_direct(rest, rest, camera(), reach(), faulty), Error);
}

}  // namespace
}  // namespace touchstone::render
