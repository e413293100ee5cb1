#include "sensors/colour/colour_levelling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "tests/sensors/colour/painted_colour_markers.h"

namespace touchstone::sensors {
namespace {

using fixtures::ColourPicture;
using fixtures::expose;
using fixtures::paint_colour_light;
using fixtures::small_colour_picture;

/// Largest difference between two levelled pictures, in grey levels, away from the picture's edge.
double largest_difference(const cv::Mat& a, const cv::Mat& b, int margin) {
  const cv::Rect inner(margin, margin, a.cols - 2 * margin, a.rows - 2 * margin);
  return cv::norm(a(inner), b(inner), cv::NORM_INF);
}

TEST(ColourLevelling, WhiteThatIsNeitherNeutralNorEvenBecomesBoth) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.white = {120.0, 200.0, 160.0};
  picture.gradient = {0.2, -0.1};
  ColourLevelling levelling(picture.spacing_px);
  const cv::Mat levelled = levelling.level(expose(paint_colour_light(picture))).clone();
  for (const cv::Point corner : {cv::Point(20, 20), cv::Point(170, 20), cv::Point(20, 145), cv::Point(170, 145)}) {
    for (int channel = 0; channel < 3; ++channel) {
      EXPECT_NEAR(levelled.at<cv::Vec3b>(corner)[channel], ColourLevelling::kWhite, 5) << corner << " " << channel;
    }
  }
}

TEST(ColourLevelling, AGradientOfLightLeavesNoTrace) {
  ColourPicture picture = small_colour_picture(16.0);
  ColourLevelling levelling(picture.spacing_px);
  const cv::Mat even = levelling.level(expose(paint_colour_light(picture))).clone();
  picture.gradient = {0.125, 0.0};
  const cv::Mat bent = levelling.level(expose(paint_colour_light(picture))).clone();
  // White's smoothing looks across the picture's edge, so the outermost spacing is left out.
  EXPECT_LE(largest_difference(even, bent, 24), 4.0);
}

TEST(ColourLevelling, ExposureLeavesNoTrace) {
  const ColourPicture picture = small_colour_picture(16.0);
  const cv::Mat light = paint_colour_light(picture);
  ColourLevelling levelling(picture.spacing_px);
  const cv::Mat full = levelling.level(expose(light)).clone();
  const cv::Mat half = levelling.level(expose(light, 0.5)).clone();
  EXPECT_LE(largest_difference(full, half, 0), 3.0);  // a grey level of the darker one is 2.3 levelled ones
}

TEST(ColourLevelling, SaysHowBrightWhiteIsWhereMarkersHideIt) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.gradient = {0.2, 0.0};
  ColourLevelling levelling(picture.spacing_px);
  levelling.level(expose(paint_colour_light(picture)));
  for (const std::size_t marker : {6u, 11u, 17u, 20u}) {
    const Eigen::Vector2d place = picture.rest(marker);
    const double lamp = 1.0 + 0.2 * (place.x() / (0.5 * picture.width) - 1.0);
    const Eigen::Vector3d white = levelling.white_at(place);
    for (int channel = 0; channel < 3; ++channel) {
      EXPECT_NEAR(white[channel], lamp * picture.white[channel], 0.02 * picture.white[channel]) << marker;
    }
  }
}

TEST(ColourLevelling, RefusesOtherPictures) {
  ColourLevelling levelling(24.0);
  EXPECT_THROW(levelling.level(cv::Mat()), Error);
  EXPECT_THROW(levelling.level(cv::Mat(100, 100, CV_8UC1, cv::Scalar(9))), Error);
  EXPECT_THROW(levelling.level(cv::Mat(100, 100, CV_16UC3, cv::Scalar::all(9))), Error);
  EXPECT_THROW(levelling.level(cv::Mat(20, 100, CV_8UC3, cv::Scalar::all(9))), Error);
  EXPECT_THROW(ColourLevelling(1.0), Error);
  EXPECT_THROW(ColourLevelling(1e9), Error);
}

}  // namespace
}  // namespace touchstone::sensors
