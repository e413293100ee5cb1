#include "render/imager/imager_presets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "render/imager/mouse_statistics.h"

namespace touchstone::render {
namespace {

/// Irradiance in the green band that frees `electrons` in the channel seen by the pixel.
double green_for(const ImagerResponse& response, int channel, double electrons) {
  return electrons / response.electrons_per_irradiance(channel, 1);
}

TEST(ImagerPresets, SayWhereTheirFiguresComeFrom) {
  for (const auto& name : imager_preset_names()) {
    const ImagerPreset preset = imager_preset(name, 1e-3);
    EXPECT_EQ(preset.name, name);
    EXPECT_NO_THROW(check(preset.imager));
    EXPECT_FALSE(preset.source.empty());
    EXPECT_FALSE(preset.uncertainty.empty());
    EXPECT_GT(preset.width * preset.height, 0);
    EXPECT_LE(preset.imager.active_area_um2, preset.pixel_pitch_um * preset.pixel_pitch_um);
    // All rows are read within a frame.
    EXPECT_LE(preset.line_time_s * preset.height, 1.0 / preset.frame_rate_Hz);
    EXPECT_NEAR(preset.imager.black_level_DN + preset.imager.gain_DN_per_e * preset.imager.full_well_e,
                (1 << preset.imager.bits) - 1, 1e-9);
  }
  EXPECT_THROW(imager_preset("imx999", 1e-3), Error);
  EXPECT_THROW(imager_preset("adns2620", -1.0), Error);
}

TEST(ImagerPresets, Davis240cHasItsPublishedDynamicRangeAndPattern) {
  const Imager imager = davis240c_frames_preset(1e-3).imager;
  EXPECT_NEAR(20.0 * std::log10(imager.full_well_e / imager.read_noise_e), 51.0, 1e-9);
  EXPECT_NEAR(imager.dsnu_e / imager.full_well_e, 0.005, 1e-12);
}

TEST(ImagerPresets, SixBitsSaturateAt63) {
  const ImagerPreset preset = adns2620_preset(1e-3);
  const cv::Mat dazzled = expose(cv::Mat(18, 18, CV_32FC3, cv::Scalar::all(1e6)), preset.imager, 1, 1);
  EXPECT_EQ(dazzled.type(), CV_8UC1);
  double least = 0.0;
  double most = 0.0;
  cv::minMaxLoc(dazzled, &least, &most);
  EXPECT_EQ(most, 63.0);
  const cv::Mat shown = develop(dazzled, preset.imager);
  cv::minMaxLoc(shown, &least, &most);
  EXPECT_EQ(most, 255.0);
}

TEST(Imager, OneBitTellsBrightFromDark) {
  Imager imager = adns2620_preset(1e-3).imager;
  imager.bits = 1;
  imager.black_level_DN = 0.0;
  imager.gain_DN_per_e = 1.0 / imager.full_well_e;
  imager.ideal = true;
  const ImagerResponse response = response_of(imager);
  for (double share : {0.0, 0.49, 0.51, 1.0}) {
    cv::Mat light(2, 2, CV_32FC3, cv::Scalar(0.0, green_for(response, 0, share * imager.full_well_e), 0.0));
    EXPECT_EQ(expose(light, imager, 1, 1).at<std::uint8_t>(1, 1), share > 0.5 ? 1 : 0) << share;
  }
}

TEST(MouseStatistics, OfKnownPictures) {
  cv::Mat raw(18, 18, CV_8UC1, cv::Scalar(63));
  MouseStatistics statistics = mouse_statistics(raw, 1e-3);
  EXPECT_EQ(statistics.pixel_sum, 159);  // the data sheet's largest value: 63 * 324 / 128 rounded down
  EXPECT_EQ(statistics.maximum, 63);
  EXPECT_EQ(statistics.minimum, 63);
  EXPECT_EQ(statistics.shutter, 24000);
  EXPECT_EQ(statistics.squal, 0);
  EXPECT_NEAR(statistics.average, 63.0, 128.0 / 324.0);

  raw = cv::Scalar(10);
  raw.at<unsigned char>(3, 5) = 50;
  raw.at<unsigned char>(9, 9) = 2;
  statistics = mouse_statistics(raw, 0.0);
  EXPECT_EQ(statistics.pixel_sum, (322 * 10 + 52) / 128);
  EXPECT_EQ(statistics.maximum, 50);
  EXPECT_EQ(statistics.minimum, 2);
  EXPECT_EQ(statistics.shutter, 0);
}

TEST(MouseStatistics, CountPlacesThatCanBeTrackedAlongBothAxes) {
  cv::Mat raw(18, 18, CV_8UC1);
  const auto fill = [&raw](const auto& value) {
    for (int row = 0; row < 18; ++row) {
      for (int column = 0; column < 18; ++column) raw.at<unsigned char>(row, column) = value(row, column);
    }
  };
  const auto number = [](int value) { return static_cast<unsigned char>(value); };
  fill([&](int, int column) { return number(3 * column); });  // a ramp
  EXPECT_EQ(trackable_features(raw), 0);
  fill([&](int row, int) { return number(row < 9 ? 5 : 60); });  // a straight edge
  EXPECT_EQ(trackable_features(raw), 0);
  // One pixel d brighter than the rest: the window round it sees gradients of d/2 on either side, along each axis:
  // the tensor's eigenvalues are d^2/18. Only windows at most 1 off in one direction see both axes' pixels.
  fill([&](int row, int column) { return number(row == 8 && column == 8 ? 40 : 10); });
  const int features = trackable_features(raw);
  EXPECT_GE(features, 9);
  EXPECT_LE(features, 25);
  fill([&](int row, int column) { return number(row == 8 && column == 8 ? 14 : 10); });  // 16/18 is below 1
  EXPECT_EQ(trackable_features(raw), 0);
  fill([&](int row, int column) { return number(row == 8 && column == 8 ? 15 : 10); });  // 25/18 is above
  EXPECT_GE(trackable_features(raw), 1);
  // Blobs 4 pixels apart: everywhere.
  fill([&](int row, int column) {
    return number(30 + static_cast<int>(25 * std::sin(1.5 * row) * std::sin(1.5 * column)));
  });
  EXPECT_GT(trackable_features(raw), 150);
  EXPECT_LE(trackable_features(raw), 196);
}

TEST(MouseStatistics, BadInputIsRefused) {
  EXPECT_THROW(mouse_statistics(cv::Mat(18, 17, CV_8UC1, cv::Scalar(0)), 1e-3), Error);
  EXPECT_THROW(mouse_statistics(cv::Mat(18, 18, CV_16UC1, cv::Scalar(0)), 1e-3), Error);
  EXPECT_THROW(mouse_statistics(cv::Mat(18, 18, CV_8UC1, cv::Scalar(64)), 1e-3), Error);
  const cv::Mat raw(18, 18, CV_8UC1, cv::Scalar(0));
  EXPECT_THROW(mouse_statistics(raw, 1.0), Error);
  EXPECT_THROW(mouse_statistics(raw, -1e-3), Error);
  EXPECT_THROW(mouse_statistics(raw, std::numeric_limits<double>::quiet_NaN()), Error);
}

}  // namespace
}  // namespace touchstone::render
