#include "lab/reflex/reflex_record.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "render/imager/imager_presets.h"
#include "tests/lab/reflex/one_band_chip.h"

namespace touchstone::lab {
namespace {

render::MotionChipSettings chip_settings() {
  render::MotionChipSettings made = test::one_band_chip();
  made.imager.ideal = true;
  return made;
}

double full_light() {
  return test::full_light(chip_settings());
}

/// A pixel's part of the full light is `share(parameter)`, but for the upper left one, which is dark.
template <typename Share>
ReflexPathLight::Picture picture(const Share& share) {
  return [share](double parameter) {
    cv::Mat light(18, 18, CV_32FC1, cv::Scalar(full_light() * share(parameter)));
    light.at<float>(0, 0) = 0.0f;
    return light;
  };
}

double number_of(const ReflexPathLight& path_light, double parameter) {
  cv::Mat light;
  path_light.light_at(parameter, light);
  return light.at<float>(5, 5) / full_light();
}

const std::vector<double> kEnds = {0.0, 5.0};

/// Pixels whose courses bend at different places, as dots' rims do.
TEST(ReflexPathLight, IsAsNearToPicturesInBetweenAsAsked) {
  const auto share = [](double z, int column) { return 0.5 + 0.3 * std::sin(3.0 * z + 0.5 * column); };
  const auto waves = [&](double z) {
    cv::Mat light(18, 18, CV_32FC1);
    for (int column = 0; column < 18; ++column) light.col(column) = full_light() * share(z, column);
    return light;
  };
  for (const double allowed : {0.02, 0.002}) {
    ReflexPathLightSettings settings;
    settings.allowed = allowed;
    const ReflexPathLight path_light(waves, kEnds, chip_settings(), settings);
    // A chord of s over a curve of bend b is off by b s^2 / 8: with b = 2.7 the steps that hold, halved from 5.
    EXPECT_GT(path_light.parameters().size(), 5.0 / std::sqrt(8 * allowed / 2.7));
    EXPECT_LT(path_light.parameters().size(), 4 * 5.0 / std::sqrt(8 * allowed / 2.7));
    EXPECT_LE(path_light.largest_off(), allowed);
    for (double z = 0.0; z <= 5.0; z += 0.01) EXPECT_NEAR(number_of(path_light, z), share(z, 5), allowed) << z;
  }
}

TEST(ReflexPathLight, StraightLightTakesThePicturesAtItsCornersAndOneBetween) {
  const std::vector<double> corners = {0.0, 1.0, 3.0};
  const ReflexPathLight path_light(picture([](double z) { return z < 1.0 ? 0.2 : 0.2 + 0.1 * (z - 1.0); }), corners,
                                   chip_settings());
  EXPECT_EQ(path_light.parameters().size(), 5U);
  EXPECT_NEAR(path_light.largest_off(), 0.0, 1e-6);
  EXPECT_NEAR(number_of(path_light, 2.5), 0.35, 1e-6);
  EXPECT_NEAR(number_of(path_light, -1.0), 0.2, 1e-6);  // before the first: the first
  EXPECT_NEAR(number_of(path_light, 9.0), 0.4, 1e-6);
}

TEST(ReflexPathLight, BadInputIsRefused) {
  const auto flat = picture([](double) { return 0.5; });
  const auto with = [&](const std::vector<double>& corners) { ReflexPathLight(flat, corners, chip_settings()); };
  EXPECT_THROW(with({0.0}), Error);
  EXPECT_THROW(with({0.0, 0.0}), Error);
  EXPECT_THROW(with({1.0, 0.0}), Error);
  EXPECT_THROW(with({0.0, std::numeric_limits<double>::infinity()}), Error);
  const auto small = [](double) { return cv::Mat(18, 17, CV_32FC1, cv::Scalar(0)); };
  EXPECT_THROW(ReflexPathLight(small, kEnds, chip_settings()), Error);
  render::MotionChipSettings colour = chip_settings();
  colour.imager = render::adns2620_preset(620e-6).imager;  // three bands
  EXPECT_THROW(ReflexPathLight(flat, kEnds, colour), Error);
  ReflexPathLightSettings few;
  few.most_pictures = 10;
  EXPECT_THROW(
      ReflexPathLight(picture([](double z) { return 0.5 + 0.5 * std::sin(100 * z); }), kEnds, chip_settings(), few),
      Error);
}

TEST(ReflexRecord, StatisticsFollowTheMotion) {
  const ReflexPathLight path_light(picture([](double z) { return 0.1 + 0.1 * z; }), kEnds, chip_settings());
  render::MotionChip chip(chip_settings(), 1, 2);
  const auto record = record_statistics(
      path_light, [](double t) { return 100.0 * t; }, chip, 75, 15);
  ASSERT_EQ(record.size(), 5U);
  for (std::size_t k = 0; k < record.size(); ++k) {
    const double middle_s = static_cast<double>(15 * k + 14) / 1500.0 + 310e-6;
    EXPECT_EQ(record[k].t_us, std::llround(1e6 * (middle_s + 310e-6)));
    EXPECT_NEAR(record[k].maximum, 1 + 62 * (0.1 + 10.0 * middle_s), 0.6);
  }
  EXPECT_THROW(record_statistics(
                   path_light, [](double) { return 0.0; }, chip, 5, 0),
               Error);
}

TEST(ReflexRecord, PicturesAreSkewedByMotion) {
  const ReflexPathLight path_light(picture([](double z) { return 0.1 + 0.1 * z; }), kEnds, chip_settings());
  render::MotionChip chip(chip_settings(), 1, 2);
  const double speed = 10.0;  // 2 mm while a picture is grabbed
  const auto images = record_images(
      path_light, [&](double t) { return speed * t; }, chip, 2);
  ASSERT_EQ(images.size(), 2U);
  for (int image = 0; image < 2; ++image) {
    for (int n = 0; n < kChipPixels; ++n) {
      const ChipPlace place = grabbed_place(n);
      if (place.row == 0 && place.column == 0) continue;
      const double t = static_cast<double>(image * kChipPixels + n) / 1500.0 + 310e-6;
      EXPECT_NEAR(images[image].image.at<std::uint8_t>(place.row, place.column), 1 + 62 * (0.1 + 0.1 * speed * t), 0.6);
    }
  }
  EXPECT_EQ(images[1].first_us - images[0].first_us, 216000);
}

}  // namespace
}  // namespace touchstone::lab
