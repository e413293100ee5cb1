#include "sensors/colour/colour_marker_finder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "sensors/colour/hue.h"
#include "tests/sensors/colour/painted_colour_markers.h"

namespace touchstone::sensors {
namespace {

using fixtures::ColourPicture;
using fixtures::expose;
using fixtures::paint_colour_light;
using fixtures::paint_colour_markers;
using fixtures::small_colour_picture;

constexpr double kDegree = 3.14159265358979323846 / 180.0;

ColourMarkerFinder finder_for(const ColourPicture& picture) {
  return ColourMarkerFinder({.grid = {picture.columns, picture.rows}});
}

void move_all(ColourPicture& picture, const Eigen::Vector2d& shift, double stretch = 1.0) {
  picture.shift_px.assign(picture.count(), shift);
  picture.stretch.assign(picture.count(), stretch);
}

int count_flawed(const ColourMarkerReading& reading) {
  return static_cast<int>(std::count_if(reading.markers.begin(), reading.markers.end(),
                                        [](const ColourMarker& one) { return one.flaw != MarkerFlaw::kNone; }));
}

double worst_ink_error(const ColourPicture& picture, const ColourMarkerReading& reading) {
  double worst = 0.0;
  for (std::size_t i = 0; i < picture.count(); ++i) {
    worst = std::max(worst, (reading.markers[i].ink_centroid_px - picture.place(i)).norm());
  }
  return worst;
}

double worst_hue_difference(const ColourMarkerReading& a, const ColourMarkerReading& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.markers.size(); ++i) {
    worst = std::max(worst, std::abs(hue_difference(a.markers[i].hue, b.markers[i].hue)));
  }
  return worst;
}

TEST(ColourMarkerFinder, FindsPlacesAndAreasToPartsOfAPixel) {
  ColourPicture picture;
  picture.noise = 1.5;
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  EXPECT_EQ(rest.light, FrameLight::kNormal);
  EXPECT_EQ(rest.grid, Eigen::Vector2i(10, 10));
  ASSERT_EQ(rest.markers.size(), 100u);
  ASSERT_EQ(count_flawed(rest), 0);
  EXPECT_NEAR(finder.spacing_px(), picture.spacing_px, 0.05);
  for (std::size_t i = 0; i < picture.count(); ++i) {
    const ColourMarker& marker = rest.markers[i];
    EXPECT_LT((marker.centroid_px - picture.rest(i)).norm(), 0.1) << i;
    EXPECT_LT((marker.ink_centroid_px - picture.rest(i)).norm(), 0.1) << i;
    EXPECT_NEAR(marker.coloured_area_px, 900.0, 18.0) << i;
    EXPECT_NEAR(marker.ink_area_px, 900.0, 18.0) << i;
  }
}

TEST(ColourMarkerFinder, FollowsInkThatMovesByMoreThanHalfAMarker) {
  ColourPicture picture;
  picture.noise = 1.5;
  ColourMarkerFinder finder = finder_for(picture);
  finder.find_rest(paint_colour_markers(picture));
  for (const double shift : {4.0, 9.0, 15.0}) {
    move_all(picture, {shift, -0.4 * shift});
    const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
    ASSERT_EQ(count_flawed(reading), 0) << shift;
    EXPECT_LT(worst_ink_error(picture, reading), 0.15) << shift;
    // The union of two equal squares has its middle midway between theirs.
    for (std::size_t i = 0; i < picture.count(); ++i) {
      const Eigen::Vector2d half = picture.rest(i) + Eigen::Vector2d(0.5 * shift, -0.2 * shift);
      EXPECT_LT((reading.markers[i].centroid_px - half).norm(), 0.2) << i;
      EXPECT_NEAR(reading.markers[i].ink_area_px, 900.0, 18.0) << i;
    }
  }
}

TEST(ColourMarkerFinder, MarkersOfFourPixelsHavePlacesToAFifthOfAPixel) {
  ColourPicture picture = small_colour_picture(4.0);
  picture.blur_px = 0.5;
  picture.noise = 1.0;
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  ASSERT_EQ(count_flawed(rest), 0);
  EXPECT_LT(worst_ink_error(picture, rest), 0.2);
  move_all(picture, {1.1, 0.4});
  const ColourMarkerReading reading = finder.find(paint_colour_markers(picture));
  ASSERT_EQ(count_flawed(reading), 0);
  EXPECT_LT(worst_ink_error(picture, reading), 0.2);
}

TEST(ColourMarkerFinder, TurnsWithTheSensor) {
  for (const double angle : {-0.12, 0.06, 0.35}) {
    ColourPicture picture = small_colour_picture(16.0);
    picture.width = picture.height = 260;
    picture.middle_px = {131.3, 128.8};
    picture.angle = angle;
    ColourMarkerFinder finder = finder_for(picture);
    const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
    ASSERT_EQ(count_flawed(rest), 0) << angle;
    EXPECT_LT(worst_ink_error(picture, rest), 0.1) << angle;
    move_all(picture, {3.0, 2.0});
    EXPECT_LT(worst_ink_error(picture, finder.find(paint_colour_markers(picture))), 0.15) << angle;
  }
}

TEST(ColourMarkerFinder, HueGoesWithTheMarkersSize) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.film_px = 20.0;  // a rim of yellow round each
  ColourMarkerFinder finder = finder_for(picture);
  double before = hue_difference(finder.find_rest(paint_colour_markers(picture)).markers[9].hue, 0.0);
  EXPECT_GT(before, 0.0);  // between red and yellow
  for (const double stretch : {1.05, 1.1, 1.15, 1.2}) {
    move_all(picture, {0.0, 0.0}, stretch);
    const double hue = hue_difference(finder.find(paint_colour_markers(picture)).markers[9].hue, 0.0);
    EXPECT_LT(hue, before - 1.0 * kDegree) << stretch;
    before = hue;
  }
}

TEST(ColourMarkerFinder, HueIsThatOfTheColoursByTheAreasTheyCover) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.film_px = 20.0;
  picture.blur_px = 0.0;
  picture.samples = 10;
  picture.middle_px = {96.0, 84.0};  // edges on the pixels' grid: no mixed pixels
  picture.spacing_px = 24.0;
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  const Eigen::Vector3d red = picture.ink.cwiseProduct(picture.film);
  const Eigen::Vector2d sum = 256.0 * hue_direction(red[0], red[1], red[2]) +
                              144.0 * hue_direction(picture.film[0], picture.film[1], picture.film[2]);
  for (const ColourMarker& marker : rest.markers) {
    ASSERT_EQ(marker.flaw, MarkerFlaw::kNone);
    EXPECT_NEAR(hue_difference(marker.hue, hue_of(sum)), 0.0, 0.5 * kDegree);  // 8 bits
  }
}

TEST(ColourMarkerFinder, HueDoesNotDependOnExposure) {
  ColourPicture picture = small_colour_picture(16.0);
  const cv::Mat light = paint_colour_light(picture);
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(expose(light));
  for (const double exposure : {0.5, 0.8, 1.2}) {
    const ColourMarkerReading reading = finder.find(expose(light, exposure));
    ASSERT_EQ(count_flawed(reading), 0) << exposure;
    EXPECT_LT(worst_hue_difference(reading, rest), 0.5 * kDegree) << exposure;
  }
}

TEST(ColourMarkerFinder, HueDoesNotDependOnAGradientOfLightOrItsColour) {
  ColourPicture picture = small_colour_picture(16.0);
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  picture.gradient = {0.125, 0.1};
  EXPECT_LT(worst_hue_difference(finder.find(paint_colour_markers(picture)), rest), 0.5 * kDegree);
  picture.white = {120.0, 180.0, 150.0};
  EXPECT_LT(worst_hue_difference(finder.find(paint_colour_markers(picture)), rest), 1.0 * kDegree);
}

TEST(ColourMarkerFinder, NoisePicturesOfOneSceneAgreeToAThirdOfADegree) {
  ColourPicture picture = small_colour_picture(30.0);  // 0.3 degrees in [Lin2019], of 50 pictures
  const cv::Mat light = paint_colour_light(picture);
  ColourMarkerFinder finder = finder_for(picture);
  finder.find_rest(expose(light, 1.0, 2.0, 1));
  std::vector<Eigen::ArrayXd> hues;
  for (std::uint64_t seed = 2; seed < 12; ++seed) {
    const ColourMarkerReading& reading = finder.find(expose(light, 1.0, 2.0, seed));
    Eigen::ArrayXd hue(static_cast<Eigen::Index>(reading.markers.size()));
    for (Eigen::Index i = 0; i < hue.size(); ++i) {
      hue[i] = hue_difference(reading.markers[static_cast<std::size_t>(i)].hue, 0.0);
    }
    hues.push_back(hue);
  }
  Eigen::ArrayXd mean = Eigen::ArrayXd::Zero(hues[0].size()), square = mean;
  for (const Eigen::ArrayXd& hue : hues) mean += hue / 10.0;
  for (const Eigen::ArrayXd& hue : hues) square += (hue - mean).square() / 9.0;
  EXPECT_LT(square.sqrt().maxCoeff(), 0.3 * kDegree);
}

TEST(ColourMarkerFinder, FilterThatParallaxPutsBesideItsMarkerIsItsOwn) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.film_scale = 1.08;  // the camera is near: films look farther out
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  ASSERT_EQ(count_flawed(rest), 0);
  EXPECT_LT(worst_ink_error(picture, rest), 0.15);
  // Corner and middle don't look alike.
  EXPECT_GT(std::abs(hue_difference(rest.markers[0].hue, rest.markers[14].hue)), 0.5 * kDegree);
}

TEST(ColourMarkerFinder, LargeMarkersAreReadAsTheyAreWhenReduced) {
  ColourPicture picture = small_colour_picture(72.0);
  picture.samples = 2;
  picture.blur_px = 1.5;
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(paint_colour_markers(picture));
  ASSERT_EQ(count_flawed(rest), 0);
  EXPECT_LT(worst_ink_error(picture, rest), 0.3);
  EXPECT_NEAR(rest.markers[0].ink_area_px, 72.0 * 72.0, 150.0);
  EXPECT_NEAR(finder.spacing_px(), picture.spacing_px, 0.2);
}

TEST(ColourMarkerFinder, SameGridInALargePictureReadsTheSame) {
  const ColourPicture picture = small_colour_picture(16.0);
  const cv::Mat small = paint_colour_markers(picture);
  cv::Mat large;
  cv::copyMakeBorder(small, large, 900, 700, 1100, 1200, cv::BORDER_REPLICATE);
  ColourMarkerFinder near = finder_for(picture), far = finder_for(picture);
  const ColourMarkerReading a = near.find_rest(small), b = far.find_rest(large);
  ASSERT_EQ(count_flawed(b), 0);
  for (std::size_t i = 0; i < picture.count(); ++i) {
    EXPECT_LT((b.markers[i].ink_centroid_px - Eigen::Vector2d(1100, 900) - a.markers[i].ink_centroid_px).norm(), 0.05);
  }
  EXPECT_LT(worst_hue_difference(a, b), 0.5 * kDegree);
}

TEST(ColourMarkerFinder, SamePictureGivesTheSameReading) {
  ColourPicture picture = small_colour_picture(16.0);
  picture.noise = 2.0;
  const cv::Mat image = paint_colour_markers(picture);
  ColourMarkerFinder finder = finder_for(picture);
  const ColourMarkerReading rest = finder.find_rest(image);
  const ColourMarkerReading again = finder.find(image);
  for (std::size_t i = 0; i < picture.count(); ++i) {
    EXPECT_EQ(again.markers[i].hue, rest.markers[i].hue);
    EXPECT_EQ(again.markers[i].centroid_px, rest.markers[i].centroid_px);
    EXPECT_EQ(again.markers[i].ink_area_px, rest.markers[i].ink_area_px);
  }
}

}  // namespace
}  // namespace touchstone::sensors
