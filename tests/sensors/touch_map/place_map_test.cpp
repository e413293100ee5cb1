#include "sensors/touch_map/place_map.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/error.h"
#include "tests/sensors/touch_map/drawn_relief.h"

namespace touchstone::sensors {
namespace {

const cv::Size kSize(320, 240);

/// A lens of 2 % barrel distortion at the picture's corner, turned a little, 0.05 mm a pixel.
Eigen::Vector2d seen_at(const Eigen::Vector2d& place) {
  const Eigen::Vector2d turned = PlanarPose{0.01, {0.1, -0.05}} * place;
  return turned / 0.05 * (1.0 - 2e-4 * turned.squaredNorm()) + Eigen::Vector2d(159.5, 119.5);
}

struct Marks {
  std::vector<Eigen::Vector2d> pixels, places;
};

Marks marks(int columns, int rows) {
  Marks all;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      all.places.emplace_back(-8.0 + 16.0 * i / (columns - 1), -6.0 + 12.0 * j / std::max(rows - 1, 1));
      all.pixels.push_back(seen_at(all.places.back()));
    }
  }
  return all;
}

TEST(PlaceMap, TakesTheLensOut) {
  const Marks all = marks(9, 7);
  const PlaceMap map = fit_place_map(all.pixels, all.places, kSize);
  EXPECT_LT(map.rms_px, 1e-9) << "a cubic is a cubic";
  EXPECT_NEAR(map.mm_per_px, 0.05, 1e-4);
  const fixtures::Surface relief = fixtures::strewn_relief(8);
  // What the bent camera sees of the relief, and what a straight one would.
  cv::Mat height(kSize, CV_32FC1, cv::Scalar(0));
  const PixelFrame frame = touch_frame(kSize, 0.05);
  for (int v = 0; v < kSize.height; ++v) {
    for (int u = 0; u < kSize.width; ++u) {
      Eigen::Vector2d place = frame.point_of({u, v});
      for (int i = 0; i < 30; ++i) place += (Eigen::Vector2d(u, v) - seen_at(place)) * 0.05;
      height.at<float>(v, u) = static_cast<float>(relief(place));
    }
  }
  const TouchImage touch = rectified(height, height > 0.02, map);
  double worst = 0.0;
  for (int v = 5; v < kSize.height - 5; ++v) {
    for (int u = 5; u < kSize.width - 5; ++u) {
      if (touch.contact.at<std::uint8_t>(v, u) == 0) continue;
      const Eigen::Vector2d place = touch_frame(kSize, map.mm_per_px).point_of({u, v});
      worst = std::max(worst, std::abs(touch.height_mm.at<float>(v, u) - relief(place)));
    }
  }
  EXPECT_LT(worst, 0.012) << "bilinear interpolation of studs 0.1 mm wide";
}

TEST(PlaceMap, WhatThePictureDoesNotShowIsNotTouched) {
  Marks all = marks(9, 7);
  for (Eigen::Vector2d& pixel : all.pixels) pixel.x() += 100.0;
  const PlaceMap map = fit_place_map(all.pixels, all.places, kSize);
  const TouchImage touch =
      rectified(cv::Mat(kSize, CV_32FC1, cv::Scalar(0.3)), cv::Mat(kSize, CV_8UC1, cv::Scalar(255)), map);
  EXPECT_EQ(touch.contact.at<std::uint8_t>(120, 300), 0);
  EXPECT_EQ(touch.contact.at<std::uint8_t>(120, 100), 255);
}

TEST(PlaceMap, MarksThatDoNotDetermineItAreRefused) {
  const Marks few = marks(4, 4), line = marks(30, 1), rows = marks(10, 3);
  EXPECT_THROW(fit_place_map(few.pixels, few.places, kSize), Error);
  EXPECT_THROW(fit_place_map(line.pixels, line.places, kSize), Error);
  EXPECT_THROW(fit_place_map(rows.pixels, rows.places, kSize), Error) << "three rows don't tell y^3";
  Marks bad = marks(9, 7);
  bad.places[3].x() = std::nan("");
  EXPECT_THROW(fit_place_map(bad.pixels, bad.places, kSize), Error);
  bad = marks(9, 7);
  EXPECT_THROW(fit_place_map(bad.pixels, std::span(bad.places).first(30), kSize), Error);
  const PlaceMap map = fit_place_map(bad.pixels, bad.places, kSize);
  EXPECT_THROW(rectified(cv::Mat(10, 10, CV_32FC1, cv::Scalar(0)), cv::Mat(10, 10, CV_8UC1, cv::Scalar(0)), map),
               Error);
}

TEST(TouchImage, TheHigherPartIsContactWhateverTheLevel) {
  for (const double level : {-0.4, 0.0, 2.0}) {
    cv::Mat height(60, 80, CV_32FC1, cv::Scalar(level));
    height(cv::Rect(20, 10, 30, 40)).setTo(level + 0.2);
    cv::Mat wanted(height.size(), CV_8UC1, cv::Scalar(0));
    wanted(cv::Rect(20, 10, 30, 40)).setTo(255);
    EXPECT_EQ(cv::norm(higher_part(height), wanted, cv::NORM_INF), 0.0) << level;
  }
}

}  // namespace
}  // namespace touchstone::sensors
