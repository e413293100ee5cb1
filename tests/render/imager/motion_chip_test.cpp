#include "render/imager/motion_chip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <set>

#include "core/error.h"
#include "render/imager/imager_presets.h"

namespace touchstone::render {
namespace {

constexpr double kExposure_s = 600e-6;

/// A grey chip of one band at 640 nm.
MotionChipSettings settings(bool ideal = false) {
  MotionChipSettings made;
  made.imager = adns2620_preset(kExposure_s).imager;
  made.imager.wavelengths_nm = Spectrum::Constant(1, 640.0);
  made.imager.quantum_efficiency = QuantumEfficiency::Constant(1, 1, 0.45);
  made.imager.ideal = ideal;
  return made;
}

/// The light that makes `number` at the longest exposure.
double light_for(const MotionChipSettings& chip, double number) {
  const ImagerResponse response = response_of(chip.imager);
  return (number - chip.imager.black_level_DN) / chip.imager.gain_DN_per_e / response.electrons_per_irradiance(0, 0);
}

/// Blobs of light, 5 pixels from one to the next, moved by (x, y).
cv::Mat blobs(const MotionChipSettings& chip, double x, double y, double level = 1.0) {
  cv::Mat light(kChipSide, kChipSide, CV_32FC1);
  for (int row = 0; row < kChipSide; ++row) {
    for (int column = 0; column < kChipSide; ++column) {
      const double waves = std::cos(2.0 * M_PI / 5.0 * (column - x)) + std::cos(2.0 * M_PI / 7.0 * (row - y));
      light.at<float>(row, column) = static_cast<float>(level * light_for(chip, 25.0 + 10.0 * waves));
    }
  }
  return light;
}

cv::Mat even(const MotionChipSettings& chip, double number) {
  return {kChipSide, kChipSide, CV_32FC1, cv::Scalar(light_for(chip, number))};
}

TEST(PixelGrab, GoesUpTheColumnsFromTheLowerLeftToTheUpperRight) {
  EXPECT_EQ(grabbed_place(0).row, 17);
  EXPECT_EQ(grabbed_place(0).column, 0);
  EXPECT_EQ(grabbed_place(17).row, 0);
  EXPECT_EQ(grabbed_place(17).column, 0);
  EXPECT_EQ(grabbed_place(323).row, 0);
  EXPECT_EQ(grabbed_place(323).column, 17);
  std::set<int> places;
  for (int n = 0; n < kChipPixels; ++n) {
    const ChipPlace place = grabbed_place(n);
    places.insert(place.row * kChipSide + place.column);
  }
  EXPECT_EQ(places.size(), 324U);
}

TEST(MotionMatch, FindsShiftsToATenthOfAPixel) {
  const MotionChipSettings chip = settings(true);
  MotionChip before(chip, 1, 1);
  const cv::Mat reference = before.expose(blobs(chip, 0, 0)).raw;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {-2.0, 1.0}, {0.5, -0.5}, {0.3, 0.8}, {-1.4, -1.7}}) {
    MotionChip now(chip, 1, 1);
    const MotionMatch match = match_motion(now.expose(blobs(chip, x, y)).raw, reference);
    EXPECT_NEAR(match.shift.x(), x, 0.1);
    EXPECT_NEAR(match.shift.y(), y, 0.1);
  }
}

TEST(MotionMatch, RefusesPicturesThatCantBeCompared) {
  const cv::Mat good(18, 18, CV_8UC1, cv::Scalar(0));
  EXPECT_THROW(match_motion(cv::Mat(18, 18, CV_16UC1, cv::Scalar(0)), good), Error);
  EXPECT_THROW(match_motion(good, cv::Mat(8, 18, CV_8UC1, cv::Scalar(0))), Error);
  EXPECT_THROW(match_motion(good, cv::Mat(18, 17, CV_8UC1, cv::Scalar(0))), Error);
}

TEST(MotionChip, ASceneAtRestDoesntMove) {
  const MotionChipSettings chip = settings();
  MotionChip moving(chip, 1, 2);
  const cv::Mat light = blobs(chip, 0.3, 0.4);
  for (int k = 0; k < 500; ++k) {
    const ChipStatistics statistics = moving.expose(light).statistics;
    EXPECT_EQ(statistics.dx, 0);
    EXPECT_EQ(statistics.dy, 0);
  }
}

TEST(MotionChip, CountsAddUpToTheTravelHoweverSlow) {
  // 6.4 pixels right and 4.3 up in 64, 640 and 6400 frames: between 0.1 and 0.001 pixels a frame, there and back.
  for (const int frames : {64, 640, 6400}) {
    const MotionChipSettings chip = settings();
    MotionChip moving(chip, 1, 2);
    int x = 0;
    int y = 0;
    for (int k = 0; k <= 2 * frames; ++k) {
      const double part = 1.0 - std::abs(1.0 - static_cast<double>(k) / frames);
      const ChipStatistics statistics = moving.expose(blobs(chip, 6.4 * part, -4.3 * part)).statistics;
      x += statistics.dx;
      y += statistics.dy;
      if (k == frames) {
        EXPECT_NEAR(x, 6.4, 1.2) << frames;
        EXPECT_NEAR(y, -4.3, 1.2) << frames;
      }
    }
    EXPECT_NEAR(x, 0, 1) << frames;
    EXPECT_NEAR(y, 0, 1) << frames;
  }
}

TEST(MotionChip, NothingToSeeDoesntMove) {
  const MotionChipSettings chip = settings();
  MotionChip dark(chip, 1, 2);
  for (int k = 0; k < 100; ++k) {
    const ChipStatistics statistics = dark.expose(even(chip, 1.0 + 0.5 * k)).statistics;
    EXPECT_EQ(statistics.dx, 0);
    EXPECT_EQ(statistics.dy, 0);
    EXPECT_LT(statistics.squal, kLeastFeatures);
  }
}

TEST(MotionChip, LightOfAnotherLevelIsntMotion) {
  const MotionChipSettings chip = settings();
  MotionChip moving(chip, 1, 2);
  for (int k = 0; k < 200; ++k) {
    const ChipStatistics statistics = moving.expose(blobs(chip, 0.2, 0.6, 0.5 + 0.004 * k)).statistics;
    EXPECT_EQ(statistics.dx, 0);
    EXPECT_EQ(statistics.dy, 0);
  }
}

TEST(MotionChip, TellsWhatThePictureHolds) {
  const MotionChipSettings chip = settings();
  MotionChip one(chip, 1, 2);
  const ChipFrame frame = one.expose(blobs(chip, 0, 0));
  double least = 0;
  double most = 0;
  cv::minMaxLoc(frame.raw, &least, &most);
  EXPECT_EQ(frame.statistics.minimum, least);
  EXPECT_EQ(frame.statistics.maximum, most);
  // Pixel_Sum drops the sum's lower 7 bits: the mean falls by up to 128 / 324.
  const double mean = cv::mean(frame.raw)[0];
  EXPECT_LE(frame.statistics.average, mean);
  EXPECT_GT(frame.statistics.average, mean - 128.0 / 324.0);
  EXPECT_GT(frame.statistics.squal, 100);
  EXPECT_EQ(frame.statistics.t_us, 600);
  EXPECT_EQ(one.expose(blobs(chip, 0, 0)).statistics.t_us, 667 + 600);
}

TEST(MotionChip, SameSeedsSameBytes) {
  const MotionChipSettings chip = settings();
  const cv::Mat light = blobs(chip, 0, 0);
  MotionChip a(chip, 1, 2);
  MotionChip b(chip, 1, 2);
  MotionChip other_noise(chip, 1, 3);
  const ChipFrame first = a.expose(light);
  EXPECT_EQ(cv::norm(first.raw, b.expose(light).raw, cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(first.raw, other_noise.expose(light).raw, cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(first.raw, a.expose(light).raw, cv::NORM_INF), 0.0);  // the next frame
}

TEST(MotionChip, ADarkSceneIsExposedForTheLongest) {
  const MotionChipSettings chip = settings();
  MotionChip dark(chip, 1, 2);
  for (int k = 0; k < 50; ++k) EXPECT_EQ(dark.expose(even(chip, 30)).shutter, 14400);  // 600 us of 24 MHz
}

TEST(MotionChip, TheShutterFollowsTheLightByASixteenth) {
  const MotionChipSettings chip = settings();
  MotionChip bright(chip, 1, 2);
  // Four times the light of the largest number: from 600 us to the range's 62 / (4 63) of it take
  // ln(4.06) / ln(16 / 15) = 22 steps of a sixteenth.
  int before = 0;
  int steps = 0;
  for (int k = 0; k < 60; ++k) {
    const ChipFrame frame = bright.expose(even(chip, 4 * 63));
    if (k > 0 && frame.shutter != before) {
      EXPECT_NEAR(before - frame.shutter, before / 16, 1);
      ++steps;
    }
    before = frame.shutter;
    if (k == 59) {
      EXPECT_LE(frame.statistics.maximum, 62);
      EXPECT_GE(frame.statistics.maximum, 45);
    }
  }
  EXPECT_NEAR(steps, 22, 2);
  // And back, when the light falls.
  for (int k = 0; k < 60; ++k) before = bright.expose(even(chip, 30)).shutter;
  EXPECT_EQ(before, 14400);
  // Saturated, where it is set to stay.
  MotionChipSettings fixed = chip;
  fixed.shutter.automatic = false;
  MotionChip held(fixed, 1, 2);
  for (int k = 0; k < 5; ++k) {
    const ChipFrame frame = held.expose(even(chip, 4 * 63));
    EXPECT_EQ(frame.shutter, 14400);
    EXPECT_EQ(frame.statistics.minimum, 63);
  }
}

TEST(PixelGrabber, TakesOnePixelAFrame) {
  // Light that grows by one number every 12 frames: pixel n of the picture shows frame n's.
  const MotionChipSettings chip = settings(true);
  MotionChip growing(chip, 1, 2);
  PixelGrabber grabber;
  int pictures = 0;
  for (int k = 0; k < 2 * kChipPixels; ++k) {
    const int n = k % kChipPixels;
    const auto image = grabber.add(growing.expose(even(chip, 5 + n / 12)));
    ASSERT_EQ(image.has_value(), n == kChipPixels - 1);
    if (!image) continue;
    ++pictures;
    for (int frame = 0; frame < kChipPixels; ++frame) {
      const ChipPlace place = grabbed_place(frame);
      EXPECT_EQ(image->image.at<std::uint8_t>(place.row, place.column), 5 + frame / 12);
    }
    EXPECT_EQ(image->first_us, k == kChipPixels - 1 ? 600 : 216600);
    EXPECT_EQ(image->last_us, std::llround(1e6 * k / 1500.0 + 600));
  }
  EXPECT_EQ(pictures, 2);
}

TEST(MotionChip, BadSettingsAreRefused) {
  const auto refused = [](const auto& change) {
    MotionChipSettings bad = settings();
    change(bad);
    EXPECT_THROW(MotionChip(bad, 1, 2), Error);
  };
  refused([](MotionChipSettings& s) { s.imager.bits = 8; });
  refused([](MotionChipSettings& s) { s.frame_rate_Hz = 0.0; });
  refused([](MotionChipSettings& s) { s.frame_rate_Hz = std::numeric_limits<double>::infinity(); });
  refused([](MotionChipSettings& s) { s.imager.exposure_s = 700e-6; });  // longer than a frame
  refused([](MotionChipSettings& s) { s.imager.exposure_s = 1e-9; });
  refused([](MotionChipSettings& s) { s.shutter = {true, 56, 62}; });  // a step jumps over it
  refused([](MotionChipSettings& s) { s.shutter = {true, 0, 60}; });
  refused([](MotionChipSettings& s) { s.shutter = {true, 40, 63}; });
  MotionChip chip(settings(), 1, 2);
  EXPECT_THROW(chip.expose(cv::Mat(18, 17, CV_32FC1, cv::Scalar(0))), Error);
  EXPECT_THROW(chip.expose(cv::Mat(18, 18, CV_32FC1, cv::Scalar(-1))), Error);
}

}  // namespace
}  // namespace touchstone::render
